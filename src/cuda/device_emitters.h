#pragma once

#include <cstddef>
#include <vector>

#include "cuda/device.h"
#include "kernels/emitters.h"

namespace lightcuts::cuda {

/// The table of everything that emits, copied into a device's memory.
class DeviceEmitters {
 public:
  /// `instances_of_scene` is the number of the scene's instances, which EmitterView::first_entry is as long as.
  DeviceEmitters(Device& device, const EmitterView& host, std::uint32_t instances_of_scene);
  [[nodiscard]] const EmitterView& view() const noexcept { return view_; }

 private:
  template <class T>
  const T* copy(Device& device, const T* host, std::size_t count);

  std::vector<DeviceBuffer<std::byte>> arrays_;
  EmitterView view_;
};

}  // namespace lightcuts::cuda
