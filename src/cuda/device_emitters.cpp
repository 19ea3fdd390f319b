#include "cuda/device_emitters.h"

namespace lightcuts::cuda {

template <class T>
const T* DeviceEmitters::copy(Device& device, const T* host, std::size_t count) {
  if (host == nullptr || count == 0) return nullptr;
  DeviceBuffer<std::byte> array(device, count * sizeof(T));
  array.upload(reinterpret_cast<const std::byte*>(host), count * sizeof(T));
  arrays_.push_back(std::move(array));
  return reinterpret_cast<const T*>(arrays_.back().data());
}

DeviceEmitters::DeviceEmitters(Device& device, const EmitterView& host, std::uint32_t instances_of_scene)
    : view_(host) {
  view_.prefix = copy(device, host.prefix, std::size_t{host.entry_count()} + 1);
  view_.instances = copy(device, host.instances, host.instance_count);
  view_.first_entry = copy(device, host.first_entry, instances_of_scene);
  view_.points = copy(device, host.points, host.point_count);
  view_.directionals = copy(device, host.directionals, host.directional_count);
  const EnvironmentView& sky = host.environment;
  if (sky.has_image()) {
    const std::size_t height = static_cast<std::size_t>(sky.height), width = static_cast<std::size_t>(sky.width);
    for (int c = 0; c < 3; ++c) view_.environment.planes[c] = copy(device, sky.planes[c], width * height);
    view_.environment.rows = copy(device, sky.rows, height + 1);
    view_.environment.columns = copy(device, sky.columns, (width + 1) * height);
  }
  device.synchronize();
}

}  // namespace lightcuts::cuda
