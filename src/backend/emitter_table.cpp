#include "backend/emitter_table.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <string>

#include "lightcuts/error.h"

namespace lightcuts {
namespace {

/// Mean luminance of a texture's texels.
double mean_luminance(const SceneView& scene, const TextureView& texture) {
  const ImageView& image = scene.images[texture.image];
  double sum = 0;
  for (std::int32_t y = 0; y < image.height; ++y) {
    for (std::int32_t x = 0; x < image.width; ++x) sum += luminance(texel_at(scene, image, x, y).rgb);
  }
  return sum / (static_cast<double>(image.width) * image.height);
}

/// How many samples see every texel of a triangle about twice, within bounds.
int samples_for_texels(const SceneView& scene, const MeshView& mesh, std::uint32_t triangle) {
  const TextureView& texture = scene.materials[mesh.material].emission_texture;
  if (texture.image == kNone) return 64;  // an alpha mask alone
  const ImageView& image = scene.images[texture.image];
  const std::uint32_t* corner = mesh.triangles[triangle];
  Vec2 t[3];
  for (int k = 0; k < 3; ++k) {
    t[k] = texture_uv(texture, texcoord_at(mesh, corner, texture.texcoord, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f));
  }
  const Vec2 a = t[1] - t[0], b = t[2] - t[0];
  const double texels = 0.5 * std::fabs(a.x * b.y - a.y * b.x) * image.width * image.height;
  return static_cast<int>(std::clamp(std::isfinite(texels) ? 2 * texels : 0.0, 8.0, 4096.0));
}

/// Mean emitted luminance over a triangle's emitting side.
double mean_emission(const SceneView& scene, const MeshView& mesh, std::uint32_t triangle) {
  const MaterialView& material = scene.materials[mesh.material];
  if (material.emission_texture.image == kNone && !material.masked) return luminance(material.emission);
  const int n = samples_for_texels(scene, mesh, triangle);
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const Vec2 b = sample_triangle(SampleStream{0, static_cast<std::uint32_t>(i), true}.draw(0).unit2(0));
    sum += luminance(emitted_radiance(scene, mesh, triangle, b.x, b.y));
  }
  return sum / n;
}

}  // namespace

EmitterTable::EmitterTable(const SceneArrays& scene) : prefix_{0} {
  const Box bounds = scene.view().bounds;
  if (!is_empty(bounds)) {
    view_.center = center(bounds);
    view_.radius = max_of(0.5f * diagonal(bounds) * 1.0001f, 1e-30f);
  }
  add_triangles(scene);
  add_punctual_lights(scene.scene());
  if (scene.scene().environment) add_environment(*scene.scene().environment);
  view_.prefix = prefix_.data();
  view_.instances = instances_.data();
  view_.instance_count = static_cast<std::uint32_t>(instances_.size());
  view_.first_entry = first_entry_.data();
}

void EmitterTable::add_triangles(const SceneArrays& scene) {
  const SceneView& view = scene.view();
  std::vector<double> texture_floor(view.material_count, -1);
  first_entry_.assign(view.instance_count, kNone);
  std::uint64_t entries = 0;
  for (std::uint32_t i = 0; i < view.instance_count; ++i) {
    const MeshView& mesh = view.meshes[view.instances[i].mesh];
    const MaterialView& material = view.materials[mesh.material];
    const double factor = luminance(material.emission);
    if (!(factor > 0) || mesh.triangle_count == 0) continue;
    double& floor = texture_floor[mesh.material];
    if (floor < 0) {
      const bool textured = material.emission_texture.image != kNone;
      floor = textured ? 0.01 * factor * mean_luminance(view, material.emission_texture)
                       : (material.masked ? 0.01 * factor : 0.0);
    }
    if (entries + mesh.triangle_count >= kNone) {
      throw Error(Code::out_of_memory, "the scene has more than 4 billion emissive triangles");
    }
    const auto first = static_cast<std::uint32_t>(entries);
    instances_.push_back({i, first});
    first_entry_[i] = first;
    entries += mesh.triangle_count;
    prefix_.resize(entries + 1);
    const double sides = material.double_sided ? 2 : 1;
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, mesh.triangle_count, 256), [&](const auto& range) {
      for (std::uint32_t t = range.begin(); t != range.end(); ++t) {
        const double area = triangle_geometry(view, i, t).area;
        prefix_[first + t + 1] = sides * static_cast<double>(kPi) * area * (mean_emission(view, mesh, t) + floor);
      }
    });
  }
  for (std::uint64_t k = 0; k < entries; ++k) prefix_[k + 1] += prefix_[k];
  view_.triangle_count = static_cast<std::uint32_t>(entries);
}

void EmitterTable::add_punctual_lights(const Scene& scene) {
  for (const PointLight& light : scene.point_lights) {
    prefix_.push_back(prefix_.back() +
                      static_cast<double>(luminance(light.intensity)) * point_light_solid_angle(light));
  }
  const double disc = static_cast<double>(kPi) * view_.radius * view_.radius;
  for (const DirectionalLight& light : scene.directional_lights) {
    prefix_.push_back(prefix_.back() + disc * luminance(light.irradiance));
  }
  view_.points = scene.point_lights.data();
  view_.directionals = scene.directional_lights.data();
  view_.point_count = static_cast<std::uint32_t>(scene.point_lights.size());
  view_.directional_count = static_cast<std::uint32_t>(scene.directional_lights.size());
}

double EmitterTable::add_environment_image(const Image& image) {
  EnvironmentView& e = view_.environment;
  e.width = image.width;
  e.height = image.height;
  const char* names[3] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    const Channel* plane = find_channel(image, names[c]);
    if (plane == nullptr || plane->values.size() != image.pixel_count() || image.pixel_count() == 0) {
      throw Error(Code::invalid_argument, std::string("the environment picture has no usable channel ") + names[c] +
                                              ": use an .hdr or .exr picture with R, G and B");
    }
    e.planes[c] = plane->values.data();
  }
  const std::size_t stride = static_cast<std::size_t>(e.width) + 1;
  columns_.assign(stride * static_cast<std::size_t>(e.height), 0);
  rows_.assign(static_cast<std::size_t>(e.height) + 1, 0);
  for (std::int32_t y = 0; y < e.height; ++y) {
    const double solid_angle = environment_solid_angle(e, y);
    double* row = columns_.data() + stride * static_cast<std::size_t>(y);
    for (std::int32_t x = 0; x < e.width; ++x) {
      row[x + 1] = row[x] + solid_angle * luminance(environment_texel(e, x, y));
    }
    rows_[y + 1] = rows_[y] + row[e.width];
  }
  e.rows = rows_.data();
  e.columns = columns_.data();
  return rows_.back();
}

void EmitterTable::add_environment(const Environment& environment) {
  view_.environment.radiance = environment.radiance;
  const double sphere = environment.image ? add_environment_image(*environment.image)
                                          : 4 * static_cast<double>(kPi) * luminance(environment.radiance);
  prefix_.push_back(prefix_.back() + sphere * static_cast<double>(kPi) * view_.radius * view_.radius);
  view_.environment_count = 1;
}

}  // namespace lightcuts
