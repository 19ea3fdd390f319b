#pragma once

#include "cuda/light_tree.h"
#include "cuda/sum_kernels.h"

namespace lightcuts::cuda {

template <int kind>
__device__ inline StagedLight stage_light(const LightArrays& lights, std::uint32_t index, Vec3 intensity) {
  StagedLight staged;
  staged.red = intensity.x;
  staged.green = intensity.y;
  staged.blue = intensity.z;
  staged.light = index;
  staged.cos_outer = staged.inverse_range = 0;
  if constexpr (kind == vpl_kind) {
    staged.position = lights.vpls[index].position;
    staged.axis = lights.vpls[index].axis;
  } else if constexpr (kind == point_kind) {
    const PointLight light = lights.points[index];
    staged.position = light.position;
    staged.axis = light.axis;
    staged.cos_outer = light.cos_outer;
    staged.inverse_range = 1.0f / max_of(light.cos_inner - light.cos_outer, 1e-6f);
  } else {
    staged.position = {};
    staged.axis = lights.directionals[index].direction;
  }
  return staged;
}

}  // namespace lightcuts::cuda
