#include "lightcuts/scene.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>

#include "scene/limits.h"

namespace lightcuts {
namespace {

/// A mesh that is drawn more often than this many triangles in all is bounded by its transformed box instead of by its
/// transformed corners, so that a million copies of a tree do not take as long to bound as to render.
constexpr std::uint64_t kExactBoundTriangles = 20'000'000;

bool is_positive(Vec3 v) { return v.x > 0 || v.y > 0 || v.z > 0; }

bool any_texel(const TextureImage& image) {
  const int colors = image.channels >= 3 ? 3 : 1;
  for (std::size_t i = 0; i < image.texels.size(); i += static_cast<std::size_t>(image.channels)) {
    for (int c = 0; c < colors; ++c) {
      if (image.texels[i + static_cast<std::size_t>(c)] != 0) return true;
    }
  }
  return false;
}

bool emits(const Scene& scene, const Material& material) {
  if (!is_positive(material.emission)) return false;
  return !material.emission_texture.present() || any_texel(scene.images[material.emission_texture.image]);
}

bool emits(const Environment& environment) {
  if (!is_positive(environment.radiance)) return false;
  if (!environment.image) return true;
  return std::any_of(environment.image->channels.begin(), environment.image->channels.end(), [](const Channel& plane) {
    return std::any_of(plane.values.begin(), plane.values.end(), [](float value) { return value > 0; });
  });
}

}  // namespace

Box mesh_bounds(const Mesh& mesh, const Affine& world_from_object) {
  using Range = tbb::blocked_range<std::size_t>;
  return tbb::parallel_reduce(
      Range(0, mesh.triangles.size(), 1 << 14), Box{},
      [&](const Range& range, Box box) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          for (const std::uint32_t corner : mesh.triangles[i]) {
            box = extend(box, transform_point(world_from_object, mesh.positions[corner]));
          }
        }
        return box;
      },
      [](Box a, Box b) { return extend(a, b); });
}

Box transform_box(const Affine& world_from_object, Box box) {
  Box result;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p{(corner & 1) != 0 ? box.hi.x : box.lo.x, (corner & 2) != 0 ? box.hi.y : box.lo.y,
                 (corner & 4) != 0 ? box.hi.z : box.lo.z};
    result = extend(result, transform_point(world_from_object, p));
  }
  return result;
}

bool emits_light(const Scene& scene) {
  if (std::any_of(scene.point_lights.begin(), scene.point_lights.end(),
                  [](const PointLight& light) { return is_positive(light.intensity); })) {
    return true;
  }
  if (std::any_of(scene.directional_lights.begin(), scene.directional_lights.end(),
                  [](const DirectionalLight& light) { return is_positive(light.irradiance); })) {
    return true;
  }
  if (scene.environment && emits(*scene.environment)) return true;

  std::vector<char> glows(scene.materials.size());
  std::transform(scene.materials.begin(), scene.materials.end(), glows.begin(),
                 [&](const Material& material) { return emits(scene, material) ? char{1} : char{0}; });
  return std::any_of(scene.instances.begin(), scene.instances.end(), [&](const Instance& instance) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    return !mesh.triangles.empty() && glows[mesh.material] != 0;
  });
}

Box scene_bounds(const Scene& scene) {
  std::vector<std::uint64_t> uses(scene.meshes.size());
  for (const Instance& instance : scene.instances) ++uses[instance.mesh];

  std::vector<Box> object_boxes(scene.meshes.size());
  const auto is_exact = [&](std::uint32_t mesh) {
    return uses[mesh] * scene.meshes[mesh].triangles.size() <= kExactBoundTriangles || uses[mesh] == 1;
  };
  for (std::uint32_t mesh = 0; mesh < scene.meshes.size(); ++mesh) {
    if (!is_exact(mesh)) object_boxes[mesh] = mesh_bounds(scene.meshes[mesh], Affine{});
  }

  Box bounds;
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    if (mesh.triangles.empty()) continue;
    bounds = extend(bounds, is_exact(instance.mesh)
                                ? mesh_bounds(mesh, instance.world_from_object)
                                : transform_box(instance.world_from_object, object_boxes[instance.mesh]));
  }
  return bounds;
}

std::uint64_t drawn_triangle_count(const Scene& scene) {
  std::uint64_t count = 0;
  for (const Instance& instance : scene.instances) count += scene.meshes[instance.mesh].triangles.size();
  return count;
}

}  // namespace lightcuts
