#pragma once

#include "cuda/device.h"
#include "cuda/picture_kernels.h"
#include "lightcuts/lights.h"

namespace lightcuts::cuda {

/// All lights of the sum in a device's memory.
struct LightArrays {
  const Vpl* vpls = nullptr;
  const PointLight* points = nullptr;
  const DirectionalLight* directionals = nullptr;
  std::uint32_t vpl_count = 0, point_count = 0, directional_count = 0;
};

/// Where a pixel's sum over lights goes.
struct SumView {
  Vec3T<double>* light;  ///< [W/m^2]; times albedo / pi it is reflected radiance
  double* lost;          ///< luminance that the clamp of the VPL distance took
  std::uint32_t* rays;   ///< shadow rays traced
};

/// Adds every light to every pixel: brute force, with exact shadow rays or without visibility.
///
/// Lights are taken in batches, a launch each, so that no launch keeps a display waiting; batches and blocks of 256
/// lights are summed in a fixed order: single precision within a block, double across.
void sum_all_lights(Device& device, const TracedScene& traced, const PixelGrid& grid, const PixelView& pixels,
                    const LightArrays& lights, bool shadow_rays, float min_distance, const SumView& sums);

}  // namespace lightcuts::cuda
