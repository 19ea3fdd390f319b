#pragma once

#include <cstdint>
#include <vector>

#include "cuda/device.h"
#include "kernels/surface_points.h"

namespace lightcuts::cuda {

/// A point that maps are drawn from: two words of 16 bytes.
struct alignas(16) SurfacePoint {
  Vec3 position;        ///< [m]
  std::uint32_t shape;  ///< entry of the table of shapes
  Vec3 normal;          ///< unit, either side
  float sink;           ///< how far the disc lies behind the surface [m]
};

/// Points on all surfaces in a device's memory.
struct PointsView {
  const SurfacePoint* points = nullptr;
  const DiscShape* shapes = nullptr;  ///< 0: a whole disc, 1: a small one
  std::uint32_t count = 0, per_map = 0;
  float largest = 0, small = 0;  ///< radius of whole and small discs [m]
  Box bounds;                    ///< of the scene
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
/// The shapes are the same too, but not their numbers. See cpu/ism/surface_points.h.
class DevicePoints {
 public:
  /// `scene` is in the device's memory. Throws Error{out_of_memory}.
  DevicePoints(Device& device, const SceneView& scene, const DeviceEdges& edges, std::uint32_t per_map,
               std::uint64_t seed);

  [[nodiscard]] const PointsView& view() const { return view_; }
  [[nodiscard]] std::uint64_t bytes() const { return points_.bytes() + shapes_.bytes(); }
  [[nodiscard]] double area() const { return area_; }  ///< of all surfaces that masks leave [m^2]
  /// Bytes that making the points takes at most, for a scene of so many triangles.
  static std::uint64_t bytes_for(std::uint32_t per_map, std::uint64_t triangles);

 private:
  DeviceBuffer<SurfacePoint> points_;
  DeviceBuffer<DiscShape> shapes_;
  PointsView view_;
  double area_ = 0;
};

}  // namespace lightcuts::cuda
