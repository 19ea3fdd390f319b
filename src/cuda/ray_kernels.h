#pragma once

#include <cstdint>

#include "cuda/device.h"
#include "kernels/scene_view.h"
#include "kernels/wide_bvh.h"

namespace lightcuts::cuda {

/// Traces `count` rays: the nearest hit of each. For tests and benchmarks; the stages trace inside their own kernels.
void trace_nearest(Device& device, const SceneView& scene, const WideBvhView& bvh, const Ray* rays, Hit* hits,
                   std::uint32_t count);

/// Traces `count` rays: 1 for each that meets anything.
void trace_any(Device& device, const SceneView& scene, const WideBvhView& bvh, const Ray* rays, std::uint8_t* blocked,
               std::uint32_t count);

}  // namespace lightcuts::cuda
