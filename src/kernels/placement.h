#pragma once

#include "kernels/camera.h"
#include "kernels/light.h"
#include "kernels/surface.h"
#include "lightcuts/lights.h"
#include "math/sample_stream.h"

namespace lightcuts {

// Camera-aware placement of VPLs: which of many candidates light what the camera sees. Shared by all backends.

/// A point that the camera sees, for which the worth of VPLs is measured.
struct PlacementPoint {
  Vec3 position, ns, ng;  ///< as Surface has them; ns is zero where the camera sees no surface
  float seen = 0;         ///< luminance of the radiance that it emits towards the camera [W/(m^2 sr)]
  float reflectance = 0;  ///< luminance of albedo / pi [1/sr]
};

/// How the points are spread over the picture: blocks of 4x4 cells, one point in each cell, so that the sixteen points
/// of a block lie close together.
struct PlacementGrid {
  std::uint32_t blocks_x = 1, blocks_y = 1;
  [[nodiscard]] LC_FN std::uint32_t block_count() const { return blocks_x * blocks_y; }
};
inline constexpr std::uint32_t kPlacementSide = 4;
inline constexpr std::uint32_t kPlacementBlock = kPlacementSide * kPlacementSide;

/// Point number `index` (blocks one after the other): where the camera looks through a random place of its cell.
template <class Tracer>
LC_KERNEL PlacementPoint trace_placement_point(const SceneView& scene, const Tracer& tracer, const CameraView& camera,
                                               PlacementGrid grid, std::uint32_t index, std::uint64_t seed) {
  const std::uint32_t block = index / kPlacementBlock, cell = index % kPlacementBlock;
  const std::uint32_t column = (block % grid.blocks_x) * kPlacementSide + cell % kPlacementSide;
  const std::uint32_t row = (block / grid.blocks_x) * kPlacementSide + cell / kPlacementSide;
  const Vec2 within = SampleStream{seed, index, false}.draw(0).unit2(0);
  const Vec2 at{(static_cast<float>(column) + within.x) / static_cast<float>(grid.blocks_x * kPlacementSide),
                (static_cast<float>(row) + within.y) / static_cast<float>(grid.blocks_y * kPlacementSide)};
  const Ray ray = camera_ray(camera, at.x * camera.width_px, at.y * camera.height_px);
  const Hit hit = tracer.intersect(ray);
  if (!hit.valid()) return {};
  const Surface s = surface_at(scene, hit, ray.direction);
  return {s.position, s.ns, s.ng, luminance(s.emission), luminance(s.albedo) * kInvPi};
}

// What a light would bring to a point if nothing were between [1/m^2, or 1 for directional lights], and the ray that
// tells. For devices; the CPU's SIMD lanes have their own loops over the same formulas.

LC_KERNEL float placement_factor(const PlacementPoint& p, const Vpl& vpl, float clamp_sq) {
  return vpl_factor(Receiver<float>{p.position, p.ns, p.ng}, vpl.position, vpl.axis, clamp_sq).clamped;
}
LC_KERNEL float placement_factor(const PlacementPoint& p, const DirectionalLight& light, float) {
  return directional_factor(Receiver<float>{p.position, p.ns, p.ng}, light.direction);
}
LC_KERNEL float placement_factor(const PlacementPoint& p, const PointLight& light, float) {
  const float range = max_of(light.cos_inner - light.cos_outer, 1e-6f);
  return point_factor(Receiver<float>{p.position, p.ns, p.ng},
                      Spot<float>{light.position, light.axis, light.cos_outer, 1.0f / range});
}
LC_KERNEL Ray placement_ray(const PlacementPoint& p, const Vpl& vpl) {
  return shadow_ray(p.position, offset_point(vpl.position, vpl.axis));
}
LC_KERNEL Ray placement_ray(const PlacementPoint& p, const DirectionalLight& light) {
  return {p.position, 0, -light.direction, kInfinity};
}
LC_KERNEL Ray placement_ray(const PlacementPoint& p, const PointLight& light) {
  return shadow_ray(p.position, light.position);
}

/// Luminance of the radiance that a point reflects of a light, visibility included.
template <class Light, class Tracer>
LC_KERNEL float placement_radiance(const PlacementPoint& p, const Light& light, Vec3 intensity, float clamp_sq,
                                   const Tracer& tracer) {
  if (!(p.reflectance > 0)) return 0;
  const float factor = placement_factor(p, light, clamp_sq);
  if (!(factor > 0) || tracer.occluded(placement_ray(p, light))) return 0;
  return luminance(intensity) * factor * p.reflectance;
}

}  // namespace lightcuts
