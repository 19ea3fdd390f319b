#include "backend/scene_arrays.h"

#include <algorithm>
#include <cmath>

namespace lightcuts {
namespace {

std::vector<float> srgb_decoding_table() {
  std::vector<float> table(256);
  for (int i = 0; i < 256; ++i) {
    const double x = i / 255.0;
    table[i] = static_cast<float>(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
  }
  return table;
}

TextureView view_of(const TextureRef& texture) {
  TextureView view{texture.image, texture.texcoord, texture.wrap_u, texture.wrap_v, texture.nearest, {}};
  std::copy(texture.uv_transform.begin(), texture.uv_transform.end(), view.uv_transform);
  return view;
}

MaterialView view_of(const Material& material) {
  MaterialView view;
  view.base_color = material.base_color;
  view.alpha = material.alpha;
  view.emission = material.emission;
  view.alpha_cutoff = material.alpha_cutoff;
  view.base_color_texture = view_of(material.base_color_texture);
  view.emission_texture = view_of(material.emission_texture);
  view.masked = material.alpha_mode == AlphaMode::mask;
  view.double_sided = material.double_sided;
  return view;
}

template <class T>
const T* data_or_null(const std::vector<T>& values) {
  return values.empty() ? nullptr : values.data();
}

MeshView view_of(const Mesh& mesh) {
  static_assert(sizeof(std::array<std::uint32_t, 3>) == sizeof(std::uint32_t[3]));
  static_assert(sizeof(std::array<std::uint8_t, 4>) == sizeof(std::uint8_t[4]));
  MeshView view;
  view.positions = data_or_null(mesh.positions);
  view.normals = data_or_null(mesh.normals);
  view.texcoords[0] = data_or_null(mesh.texcoords[0]);
  view.texcoords[1] = data_or_null(mesh.texcoords[1]);
  view.colors = reinterpret_cast<const std::uint8_t(*)[4]>(data_or_null(mesh.colors));
  view.triangles = reinterpret_cast<const std::uint32_t(*)[3]>(data_or_null(mesh.triangles));
  view.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
  view.material = mesh.material;
  return view;
}

Box bounds_of(const SceneView& scene) {
  Box box;
  for (std::uint32_t i = 0; i < scene.instance_count; ++i) {
    const InstanceView& instance = scene.instances[i];
    const MeshView& mesh = scene.meshes[instance.mesh];
    for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
      for (const std::uint32_t corner : mesh.triangles[t]) {
        box = extend(box, transform_point(instance.world_from_object, mesh.positions[corner]));
      }
    }
  }
  return box;
}

}  // namespace

SceneArrays::SceneArrays(const Scene& scene) : scene_(&scene), linear_from_srgb_(srgb_decoding_table()) {
  for (const TextureImage& image : scene.images) {
    images_.push_back({image.texels.data(), image.width, image.height, image.channels});
  }
  for (const Material& material : scene.materials) materials_.push_back(view_of(material));
  for (const Mesh& mesh : scene.meshes) meshes_.push_back(view_of(mesh));
  for (const Instance& instance : scene.instances) instances_.push_back({instance.world_from_object, instance.mesh});
  view_.images = images_.data();
  view_.materials = materials_.data();
  view_.meshes = meshes_.data();
  view_.instances = instances_.data();
  view_.linear_from_srgb = linear_from_srgb_.data();
  view_.image_count = static_cast<std::uint32_t>(images_.size());
  view_.material_count = static_cast<std::uint32_t>(materials_.size());
  view_.mesh_count = static_cast<std::uint32_t>(meshes_.size());
  view_.instance_count = static_cast<std::uint32_t>(instances_.size());
  view_.bounds = bounds_of(view_);
  view_.diagonal = diagonal(view_.bounds);
}

void SceneArrays::update_materials() {
  for (std::size_t m = 0; m < materials_.size(); ++m) materials_[m] = view_of(scene_->materials[m]);
}

}  // namespace lightcuts
