#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lightcuts/image.h"
#include "lightcuts/math.h"

namespace lightcuts {

inline constexpr std::uint32_t kNone = 0xffffffffu;  ///< "no such thing" for an index

/// 8-bit picture that textures sample. One to four channels: grey, grey-alpha, RGB, RGBA.
struct TextureImage {
  std::string name;  ///< file or image name, for messages
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> texels;  ///< row by row from the top left, width * height * channels
};

enum class Wrap : std::uint8_t { repeat, mirrored_repeat, clamp_to_edge };

/// A picture as a material uses it: which one, read with which texture coordinates, transformed how.
struct TextureRef {
  std::uint32_t image = kNone;  ///< index into Scene::images, kNone: no texture
  std::uint8_t texcoord = 0;    ///< which set of texture coordinates: 0 or 1
  Wrap wrap_u = Wrap::repeat;
  Wrap wrap_v = Wrap::repeat;
  bool nearest = false;  ///< nearest texel instead of bilinear
  /// Affine map of texture coordinates: u' = m[0] u + m[1] v + m[2], v' = m[3] u + m[4] v + m[5].
  std::array<float, 6> uv_transform{1, 0, 0, 0, 1, 0};

  [[nodiscard]] bool present() const { return image != kNone; }
};

enum class AlphaMode : std::uint8_t { opaque, mask };

/// Surface of a mesh. Colours are linear Rec. 709; texels of colour textures are sRGB-encoded.
///
/// Reflection is Lambertian with albedo = base_color * texture * vertex colour for now; the metallic-roughness set is
/// carried so that glossy reflection can be added as a kernel. Both sides of a triangle reflect and block light.
struct Material {
  std::string name;
  Vec3 base_color{1, 1, 1};  ///< [0, 1]
  float alpha = 1;           ///< base alpha, [0, 1]
  TextureRef base_color_texture;
  Vec3 emission{0, 0, 0};  ///< emitted radiance [W/(m^2 sr)] of the front side, >= 0
  TextureRef emission_texture;
  float metallic = 0;
  float roughness = 1;
  TextureRef metallic_roughness_texture;
  AlphaMode alpha_mode = AlphaMode::opaque;
  float alpha_cutoff = 0.5f;  ///< with AlphaMode::mask a hit whose alpha is below it is not there
  bool double_sided = false;  ///< emission on both sides; reflection is two-sided in any case
};

/// Indexed triangles with one material, in a space of their own. Counter-clockwise corners face the front.
struct Mesh {
  std::string name;
  std::vector<Vec3> positions;                          ///< [m]
  std::vector<Vec3> normals;                            ///< shading normals, empty (flat) or one a position
  std::array<std::vector<Vec2>, 2> texcoords;           ///< each empty or one a position; v points down as in glTF
  std::vector<std::array<std::uint8_t, 4>> colors;      ///< linear RGBA / 255, empty or one a position
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into positions
  std::uint32_t material = 0;                           ///< index into Scene::materials
};

/// A mesh placed in the world. The mesh is not copied.
struct Instance {
  std::string name;
  std::uint32_t mesh = 0;
  Affine world_from_object;
};

/// Point light, or spot light where `cos_outer` is above -1. Radiant intensity I(w) = intensity * s^2 with
/// s = clamp((cos(w, axis) - cos_outer) / (cos_inner - cos_outer), 0, 1), as KHR_lights_punctual has it.
struct PointLight {
  Vec3 position;         ///< [m]
  Vec3 intensity;        ///< [W/sr], >= 0
  Vec3 axis{0, 0, -1};   ///< unit, where the spot points
  float cos_inner = -1;  ///< cosine of the angle up to which the spot has its full intensity, > cos_outer for a spot
  float cos_outer = -2;  ///< cosine of the angle from which on it is dark; -2: shines everywhere
};

/// Light from infinitely far, e.g. the sun.
struct DirectionalLight {
  Vec3 direction;   ///< unit, the way the light travels
  Vec3 irradiance;  ///< on a surface that faces it [W/m^2], >= 0
};

/// Light from outside: one radiance, or an equirectangular picture (times `radiance`).
/// The picture's centre is seen along -z, its top row along +y; u grows to the right as seen from inside.
struct Environment {
  Vec3 radiance{1, 1, 1};              ///< [W/(m^2 sr)], or the factor of the picture
  std::shared_ptr<const Image> image;  ///< planes R, G and B, or null
};

/// Looks along -z of its own space, +y up; pixels are square.
struct Camera {
  std::string name;
  Affine world_from_camera;       ///< orthonormal axes
  float vertical_fov_rad = 0.8f;  ///< full angle, (0, pi); unused where orthographic_height is set
  float orthographic_height = 0;  ///< above 0: orthographic, the height of what is seen [m]
  float aspect = 0;               ///< width / height the author meant, 0: not said
};

/// Everything that is rendered. Plain values; `validate` checks and repairs them.
struct Scene {
  std::string name;
  std::vector<TextureImage> images;
  std::vector<Material> materials;
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  std::vector<PointLight> point_lights;
  std::vector<DirectionalLight> directional_lights;
  std::optional<Environment> environment;
  std::vector<Camera> cameras;
  int width = 0;  ///< size the author meant [pixels], 0: not said
  int height = 0;
};

/// Checks every value and index of a scene and repairs what is harmless.
///
/// Repaired, each with one sentence in the result: triangles without area or with corners that are not finite are
/// removed, normals that are not finite or zero are computed, colours out of range are clamped, instances with
/// a singular transform and lights without intensity are removed, a missing material is added.
/// Throws Error{invalid_scene} where a repair would hide a mistake: an index out of range, counts that do not match.
/// Afterwards every stage may trust every index. Does not require that something emits: see `require_emitter`.
std::vector<std::string> validate(Scene& scene);

/// True if some light, some environment or some triangle emits.
bool emits_light(const Scene& scene);

/// Box around all instances [m], world space; empty if there are none.
Box scene_bounds(const Scene& scene);

/// Triangles drawn, instances counted each time.
std::uint64_t drawn_triangle_count(const Scene& scene);

/// Scene::cameras[i] by name or by number written out; the first one (or one that frames the scene, from inside a
/// closed room or from outside) if `which` is empty. Throws Error{invalid_argument} that lists the names if none fits.
Camera select_camera(const Scene& scene, const std::string& which);

/// Camera at `eye` that looks at `target`; +y is up, or +z where the view is vertical.
/// Throws Error{invalid_argument} if both points agree, one is beyond 1e12 m, or the angle is out of (0, pi).
Camera look_at(Vec3 eye, Vec3 target, float vertical_fov_rad);

/// One key of a built-in scene, as `builtin:NAME?key=value` writes it.
struct BuiltinKey {
  std::string name, default_value, meaning;
};
/// A scene written as code.
struct BuiltinInfo {
  std::string name, summary;
  std::vector<BuiltinKey> keys;
};
/// The built-in scenes and their keys.
const std::vector<BuiltinInfo>& builtin_scenes();

/// Makes the scene of `spec`: NAME[?key=value[&key=value...]], without the "builtin:".
/// Throws Error{invalid_argument} naming what exists if the name, a key or a value is wrong.
Scene make_builtin_scene(const std::string& spec);

}  // namespace lightcuts
