#pragma once

#include "cuda/vpl_kernels.h"
#include "lightcuts/lights.h"

namespace lightcuts::cuda {

/// Lights sent to a device.
inline DeviceLights send_lights(Device& device, const Lights& lights) {
  DeviceLights sent;
  sent.vpl_count = static_cast<std::uint32_t>(lights.vpls.size());
  sent.point_count = static_cast<std::uint32_t>(lights.points.size());
  sent.directional_count = static_cast<std::uint32_t>(lights.directionals.size());
  sent.vpls = DeviceBuffer<Vpl>(device, lights.vpls.size());
  sent.points = DeviceBuffer<PointLight>(device, lights.points.size());
  sent.directionals = DeviceBuffer<DirectionalLight>(device, lights.directionals.size());
  sent.vpls.upload(lights.vpls.data(), lights.vpls.size());
  sent.points.upload(lights.points.data(), lights.points.size());
  sent.directionals.upload(lights.directionals.data(), lights.directionals.size());
  device.synchronize();
  return sent;
}

}  // namespace lightcuts::cuda
