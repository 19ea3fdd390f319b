#pragma once

#include <cstdint>

#include "lightcuts/math.h"
#include "lightcuts/scene.h"

namespace lightcuts {

// The scene as kernels see it: plain pointers and counts, in host or in device memory. A view owns nothing; whoever
// makes one (SceneArrays, the CUDA backend) keeps the arrays alive.

struct ImageView {
  const std::uint8_t* texels = nullptr;  ///< width * height * channels, row by row from the top left
  std::int32_t width = 0, height = 0, channels = 0;
};

/// TextureRef without std::array, whose members device code cannot call.
struct TextureView {
  std::uint32_t image = kNone;  ///< kNone: no texture
  std::uint8_t texcoord = 0;
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  bool nearest = false;
  float uv_transform[6] = {1, 0, 0, 0, 1, 0};
};

struct MaterialView {
  Vec3 base_color;
  float alpha = 1;
  Vec3 emission;
  float alpha_cutoff = 0;  ///< meaningful where `masked`
  TextureView base_color_texture;
  TextureView emission_texture;
  bool masked = false;
  bool double_sided = false;
};

struct MeshView {
  const Vec3* positions = nullptr;
  const Vec3* normals = nullptr;                  ///< or nullptr: flat
  const Vec2* texcoords[2] = {nullptr, nullptr};  ///< or nullptr
  const std::uint8_t (*colors)[4] = nullptr;      ///< or nullptr
  const std::uint32_t (*triangles)[3] = nullptr;
  std::uint32_t triangle_count = 0;
  std::uint32_t material = 0;
};

struct InstanceView {
  Affine world_from_object;
  std::uint32_t mesh = 0;
};

struct SceneView {
  const ImageView* images = nullptr;
  const MaterialView* materials = nullptr;
  const MeshView* meshes = nullptr;
  const InstanceView* instances = nullptr;
  const float* linear_from_srgb = nullptr;  ///< 256 entries: decodes a byte of a colour texture
  std::uint32_t image_count = 0, material_count = 0, mesh_count = 0, instance_count = 0;
  Box bounds;          ///< world space
  float diagonal = 0;  ///< of `bounds` [m]
};

/// A ray; `direction` need not be unit length, distances count in its length.
struct Ray {
  Vec3 origin;
  float t_min = 0;
  Vec3 direction;
  float t_max = kInfinity;
};

/// Where a ray met a triangle: barycentric (u, v) weigh corners 1 and 2.
struct Hit {
  float t = kInfinity;
  float u = 0, v = 0;
  std::uint32_t instance = kNone;  ///< kNone: nothing was hit
  std::uint32_t triangle = 0;      ///< within the instance's mesh

  [[nodiscard]] LC_FN bool valid() const { return instance != kNone; }
};

}  // namespace lightcuts
