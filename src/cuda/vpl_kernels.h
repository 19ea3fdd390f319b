#pragma once

#include <cstdint>

#include "cuda/device.h"
#include "cuda/picture_kernels.h"
#include "kernels/light_path.h"
#include "lightcuts/lights.h"
#include "lightcuts/render.h"

namespace lightcuts::cuda {

/// All lights of the sum, kept in a device's memory.
struct DeviceLights {
  DeviceBuffer<Vpl> vpls;
  DeviceBuffer<PointLight> points;
  DeviceBuffer<DirectionalLight> directionals;
  std::uint32_t vpl_count = 0, point_count = 0, directional_count = 0;
  std::uint64_t primary_count = 0, sky_count = 0, path_count = 0;
};

/// Luminance of the flux of each kind of emitter [W].
struct EmitterPowers {
  double area = 0, punctual = 0, sky = 0;
};

/// Makes every light of the sum on the device, from the streams that the CPU draws from and in the same order (see
/// cpu/vpl_tracer.h); a path whose rounding differs may differ. `scene` adds the punctual lights.
/// Throws Error{invalid_argument, out_of_memory}.
DeviceLights trace_vpls(Device& device, const TracedScene& traced, const EmitterPowers& powers, const Scene& scene,
                        const VplOptions& options);

}  // namespace lightcuts::cuda
