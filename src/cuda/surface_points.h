#pragma once

#include <cstdint>
#include <vector>

#include "cuda/device.h"
#include "kernels/surface_points.h"

namespace lightcuts::cuda {

/// A point that maps are drawn from: two words of 16 bytes.
struct alignas(16) SurfacePoint {
  Vec3 position;       ///< [m]
  std::uint32_t cuts;  ///< what its disc is cut by, see below
  Vec3 normal;         ///< unit, either side
  float sink;          ///< see pack_sink
};

/// An edge that a disc is cut by: of a place q of its plane, dot(inward, q) >= offset remains.
struct alignas(16) DiscEdge {
  Vec3 inward;
  float offset;
};

// SurfacePoint::cuts: a bit for each edge that comes near the point's disc, and which four edges they are among; 0: a
// whole disc. What is near does not depend on the light, so maps need not find it out.
static_assert(kDiscEdges == 4);
LC_FN std::uint32_t near_edges(std::uint32_t cuts) { return cuts & 15u; }
LC_FN std::uint32_t first_edge(std::uint32_t cuts) { return cuts >> 4 << 2; }

/// Points on all surfaces in a device's memory.
struct PointsView {
  const SurfacePoint* points = nullptr;
  const float* radii = nullptr;  ///< of their discs [m]
  const DiscEdge* edges = nullptr;
  std::uint32_t count = 0, per_map = 0;
  float largest = 0;  ///< radius of whole discs [m]
  Box bounds;         ///< of the scene
};

/// The hard edges of a scene's meshes on a device.
///
/// Found by the host, once a scene: they follow from the meshes' topology alone (a sort of edges by corner positions),
/// whatever the camera, the lights, the options and the placing of instances.
class DeviceEdges {
 public:
  /// `host` is the scene's view in the host's memory.
  DeviceEdges(Device& device, const SceneView& host);
  [[nodiscard]] const MeshEdgesView* meshes() const { return views_.data(); }
  /// Triangles before each instance, and all of them last.
  [[nodiscard]] const std::uint32_t* instance_begin() const { return instance_begin_.data(); }
  [[nodiscard]] std::uint32_t triangle_count() const { return triangle_count_; }

 private:
  DeviceBuffer<std::uint8_t> hard_;
  DeviceBuffer<std::uint32_t> next_, instance_begin_;
  DeviceBuffer<MeshEdgesView> views_;
  std::uint32_t triangle_count_ = 0;
};

/// Points on all surfaces, evenly by area: SurfacePoints of the CPU, made on the device from the same streams.
///
/// Their discs are the same too, but not the numbers of what cuts them. See cpu/ism/surface_points.h.
class DevicePoints {
 public:
  /// `scene` is in the device's memory. Throws Error{out_of_memory}.
  DevicePoints(Device& device, const SceneView& scene, const DeviceEdges& edges, std::uint32_t per_map,
               std::uint64_t seed);

  [[nodiscard]] const PointsView& view() const { return view_; }
  [[nodiscard]] std::uint64_t bytes() const { return points_.bytes() + radii_.bytes() + edges_.bytes(); }
  [[nodiscard]] double area() const { return area_; }  ///< of all surfaces that masks leave [m^2]
  /// Bytes that making the points takes at most, for a scene of so many triangles.
  static std::uint64_t bytes_for(std::uint32_t per_map, std::uint64_t triangles);

 private:
  DeviceBuffer<SurfacePoint> points_;
  DeviceBuffer<float> radii_;
  DeviceBuffer<DiscEdge> edges_;
  PointsView view_;
  double area_ = 0;
};

}  // namespace lightcuts::cuda
