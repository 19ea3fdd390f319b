#pragma once

#include <vector>

#include "cuda/picture_kernels.h"
#include "cuda/vpl_kernels.h"
#include "lightcuts/render.h"

namespace lightcuts::cuda {

/// The worth of every VPL and sky sample for what options.view sees (backend/vpl_placement.h), in their order; as the
/// CPU rates them but for rounding. Throws Error{out_of_memory}.
std::vector<float> rate_for_camera(Device& device, const TracedScene& traced, const VplOptions& options,
                                   const DeviceLights& lights);

}  // namespace lightcuts::cuda
