#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/device.h"
#include "kernels/scene_view.h"
#include "kernels/wide_bvh.h"
#include "lightcuts/scene.h"

namespace lightcuts::cuda {

/// A scene in a device's memory: what a host view points to, copied, and the tree over its triangles.
class DeviceScene {
 public:
  /// Copies every array behind `host`, the view of `scene`, and builds the tree. Throws Error{out_of_memory}.
  DeviceScene(Device& device, const Scene& scene, const SceneView& host);

  /// Copies the materials of `host` again, into the same places.
  void update_materials(const SceneView& host);

  [[nodiscard]] const SceneView& view() const noexcept { return view_; }
  [[nodiscard]] WideBvhView bvh() const noexcept {
    return {node_count_ == 0 ? nullptr : nodes_.data(), node_count_ == 0 ? nullptr : shadow_nodes_.data(),
            leaves_.data()};
  }
  [[nodiscard]] std::uint32_t triangle_count() const noexcept { return triangle_count_; }
  [[nodiscard]] std::uint32_t node_count() const noexcept { return node_count_; }

 private:
  template <class T>
  T* copy(Device& device, const T* host, std::size_t count);

  std::vector<DeviceBuffer<std::byte>> arrays_;
  Device* device_;
  SceneView view_;
  DeviceBuffer<WideNode> nodes_, shadow_nodes_;
  DeviceBuffer<LeafTriangle> leaves_;
  std::uint32_t triangle_count_ = 0, node_count_ = 0;
};

}  // namespace lightcuts::cuda
