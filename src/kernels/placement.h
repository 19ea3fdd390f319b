#pragma once

#include "kernels/camera.h"
#include "kernels/surface.h"
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

}  // namespace lightcuts
