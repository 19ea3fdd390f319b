#include "backend/surface_rays.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "kernels/surface.h"
#include "math/sample_stream.h"
#include "math/warp.h"

namespace lightcuts {
namespace {

/// A point of triangle `drawn`, counted over all instances, and a direction.
Ray surface_ray(const SceneView& scene, const std::vector<std::uint32_t>& begin, const Sample4& a, const Sample4& b) {
  const auto drawn = static_cast<std::uint32_t>(a.unit_double(0) * begin.back());
  const auto instance =
      static_cast<std::uint32_t>(std::upper_bound(begin.begin(), begin.end(), drawn) - begin.begin() - 1);
  const TriangleGeometry g = triangle_geometry(scene, instance, drawn - begin[instance]);
  const Vec2 at = sample_triangle(a.unit2(1));
  Ray ray;
  ray.direction = sample_sphere(b.unit2(0));
  const Vec3 side = dot(ray.direction, g.front) < 0 ? -g.front : g.front;
  ray.origin = point_on_triangle(g, at.x, at.y, side);
  return ray;
}

}  // namespace

std::vector<Ray> surface_rays(const SceneView& scene, std::uint32_t count, std::uint64_t seed) {
  std::vector<std::uint32_t> begin{0};
  for (std::uint32_t i = 0; i < scene.instance_count; ++i) {
    begin.push_back(begin.back() + scene.meshes[scene.instances[i].mesh].triangle_count);
  }
  std::vector<Ray> rays(count);
  tbb::parallel_for(0u, count, [&](std::uint32_t i) {
    const SampleStream stream{seed, i, false};
    rays[i] = surface_ray(scene, begin, stream.draw(0), stream.draw(1));
  });
  return rays;
}

}  // namespace lightcuts
