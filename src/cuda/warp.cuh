#pragma once

#include "lightcuts/math.h"

/// What the lanes of a warp do together; all of them must take part.
namespace lightcuts::cuda {

inline constexpr unsigned kAllLanes = ~0u;

template <class Op>
__device__ inline float over_warp(float v, Op op) {
#pragma unroll
  for (int step = 16; step > 0; step /= 2) v = op(v, __shfl_xor_sync(kAllLanes, v, step));
  return v;
}
__device__ inline float warp_min(float v) {
  return over_warp(v, [](float a, float b) { return fminf(a, b); });
}
__device__ inline float warp_max(float v) {
  return over_warp(v, [](float a, float b) { return fmaxf(a, b); });
}
/// The same of values that are not negative.
__device__ inline float warp_max_positive(float v) {
#if __CUDA_ARCH__ >= 800
  return __uint_as_float(__reduce_max_sync(kAllLanes, __float_as_uint(v)));
#else
  return warp_max(v);
#endif
}
__device__ inline float warp_sum(float v) {
  return over_warp(v, [](float a, float b) { return a + b; });
}
__device__ inline Vec3 warp_min(Vec3 v) { return {warp_min(v.x), warp_min(v.y), warp_min(v.z)}; }
__device__ inline Vec3 warp_max(Vec3 v) { return {warp_max(v.x), warp_max(v.y), warp_max(v.z)}; }
__device__ inline Vec3 warp_sum(Vec3 v) { return {warp_sum(v.x), warp_sum(v.y), warp_sum(v.z)}; }
__device__ inline Vec3 from_lane(Vec3 v, int lane) {
  return {__shfl_sync(kAllLanes, v.x, lane), __shfl_sync(kAllLanes, v.y, lane), __shfl_sync(kAllLanes, v.z, lane)};
}

}  // namespace lightcuts::cuda
