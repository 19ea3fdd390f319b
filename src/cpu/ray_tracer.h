#pragma once

#include <cstdint>
#include <memory>

#include "cpu/ray_packet.h"
#include "kernels/scene_view.h"

namespace lightcuts {

/// Which triangle a ray meets first, and whether it meets any. Every triangle blocks from both sides, except where its
/// alpha mask cuts it away.
///
/// The view's arrays must outlive it. All queries may run on any number of threads at once.
class RayTracer {
 public:
  /// Builds a bounding volume hierarchy with Embree: meshes that are placed once, or all where fewer than
  /// `bake_below` triangles are drawn, in world space, others by instances. Throws Error{out_of_memory}.
  explicit RayTracer(const SceneView& scene, std::uint64_t bake_below = 2'000'000);
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  /// The first hit with t in (t_min, t_max); not valid, with infinite t, where there is none.
  [[nodiscard]] Hit intersect(const Ray& ray) const;
  [[nodiscard]] bool occluded(const Ray& ray) const;

  /// Bit i of the result: lane i is blocked; lanes outside the mask are not looked at. For rays that are coherent.
  [[nodiscard]] std::uint32_t occluded4(const RayPacket4& rays, std::uint32_t active_mask) const;
  [[nodiscard]] std::uint32_t occluded8(const RayPacket8& rays, std::uint32_t active_mask) const;
  [[nodiscard]] std::uint32_t occluded16(const RayPacket16& rays, std::uint32_t active_mask) const;

 private:
  struct Bvh;
  std::unique_ptr<Bvh> bvh_;
};

}  // namespace lightcuts
