#include <algorithm>

#include <type_traits>

#include "cuda/fast_float.cuh"
#include "cuda/sum_kernels.h"
#include "cuda/tracer.cuh"
#include "kernels/light.h"

namespace lightcuts::cuda {
namespace {

constexpr int kSumThreads = 128;
constexpr std::uint32_t kBlockLights = 256;  ///< summed in single precision before they go into the total

/// A pixel's running sums while it walks over lights.
struct PixelSum {
  Vec3 block{};
  float block_lost = 0;
  Vec3T<double> total{};
  double lost = 0;
  std::uint32_t rays = 0;

  __device__ void close_block() {
    total += Vec3T<double>{block.x, block.y, block.z};
    lost += block_lost;
    block = {};
    block_lost = 0;
  }
};

using PixelReceiver = Receiver<float>;

// What differs between the kinds of light: the factor of one at a receiver, and where its shadow ray ends.

struct VplOps {
  using Light = Vpl;
  static constexpr bool clamps = true;
  __device__ static VplFactor<float> factor(const PixelReceiver& receiver, const Vpl& light, float min_distance_sq) {
    return vpl_factor(receiver, light.position, light.axis, min_distance_sq);
  }
  __device__ static Vec3 intensity(const Vpl& light) { return light.intensity; }
  __device__ static Ray shadow_ray(Vec3 from, const Vpl& light) {
    return {from, 0, offset_point(light.position, light.axis) - from, kShadowRayEnd};
  }
};

struct PointOps {
  using Light = PointLight;
  static constexpr bool clamps = false;
  __device__ static VplFactor<float> factor(const PixelReceiver& receiver, const PointLight& light, float) {
    const float range = max_of(light.cos_inner - light.cos_outer, 1e-6f);
    const float f = point_factor(receiver, Spot<float>{light.position, light.axis, light.cos_outer, 1.0f / range});
    return {f, f, 0};
  }
  __device__ static Vec3 intensity(const PointLight& light) { return light.intensity; }
  __device__ static Ray shadow_ray(Vec3 from, const PointLight& light) {
    return {from, 0, light.position - from, kShadowRayEnd};
  }
};

struct DirectionalOps {
  using Light = DirectionalLight;
  static constexpr bool clamps = false;
  __device__ static VplFactor<float> factor(const PixelReceiver& receiver, const DirectionalLight& light, float) {
    const float f = directional_factor(receiver, light.direction);
    return {f, f, 0};
  }
  __device__ static Vec3 intensity(const DirectionalLight& light) { return light.irradiance; }
  __device__ static Ray shadow_ray(Vec3 from, const DirectionalLight& light) {
    return {from, 0, -light.direction, kInfinity};
  }
};

/// One thread a pixel; all threads of a warp read the same light.
template <class Ops, bool shadow_rays>
__global__ void __launch_bounds__(kSumThreads)
    sum_kernel(DeviceTracer tracer, PixelView pixels, std::uint32_t slots,
               const typename Ops::Light* __restrict__ lights, std::uint32_t first, std::uint32_t last,
               float min_distance_sq, SumView sums) {
  const std::uint32_t slot = blockIdx.x * kSumThreads + threadIdx.x;
  if (slot >= slots) return;
  const PixelReceiver receiver{pixels.position[slot], pixels.ns[slot], pixels.ng[slot]};
  if (receiver.ns == Vec3{}) return;
  PixelSum sum;
  for (std::uint32_t block = first; block < last; block += kBlockLights) {
    const std::uint32_t end = min_of(last, block + kBlockLights);
    for (std::uint32_t i = block; i < end; ++i) {
      const typename Ops::Light light = lights[i];
      const VplFactor<float> factor = Ops::factor(receiver, light, min_distance_sq);
      if constexpr (shadow_rays) {
        if (!(factor.unclamped > 0)) continue;
        ++sum.rays;
        if (tracer.occluded(Ops::shadow_ray(receiver.position, light))) continue;
      }
      sum.block += Ops::intensity(light) * factor.clamped;
      if constexpr (Ops::clamps) {
        if (factor.distance_sq < min_distance_sq && factor.unclamped > 0) {
          sum.block_lost += luminance(Ops::intensity(light)) * (factor.unclamped - factor.clamped);
        }
      }
    }
    sum.close_block();
  }
  sums.light[slot] += sum.total;
  sums.lost[slot] += sum.lost;
  sums.rays[slot] += sum.rays;
}

// --- VPLs without visibility: several pixels a thread, lights through shared memory ---
//
// Issue slots bound this loop (docs/results/gpu.md counts them): what a light has for a whole block of pixels is found
// out once, where it is staged. Only lights that may be nearer to some pixel than the clamp are asked for it.

constexpr int kFlatThreads = 128;
constexpr int kPixelsEach = 4;
constexpr int kFlatWarps = kFlatThreads / 32;
/// Lights nearer than this to a block's pixels are taken with care: fourth powers of smaller distances vanish [m^2].
constexpr float kCarefulDistanceSq = 1e-12f;

/// A pixel as the inner loop reads it; the normals are negated, towards the way that light comes.
struct FlatReceiver {
  Vec3 position, ns, ng;
};

/// What all lights of a block of 256 have, as the inner loop reads it.
struct StagedVpls {
  float4 position_red[kBlockLights], axis_green[kBlockLights];
  float2 blue_near[kBlockLights];  ///< second: 1 where it may be nearer than the clamp to one of the pixels
};

/// Cosines at both ends times the squared distance. `flat`: both of the pixel's normals agree.
template <bool flat>
__device__ inline float pair_cosines(const FlatReceiver& receiver, Vec3 axis, Vec3 travel) {
  float cos_receiver = fmaxf(dot(receiver.ns, travel), 0.0f);
  if constexpr (!flat) cos_receiver = dot(receiver.ng, travel) > 0 ? cos_receiver : 0.0f;
  return cos_receiver * fmaxf(dot(axis, travel), 0.0f);
}

__device__ inline float inverse(float v) { return reciprocal(FastFloat(v)).value; }

/// Adds one VPL, anywhere, to a pixel.
template <bool flat>
__device__ void add_near_vpl(const FlatReceiver& receiver, const float4& a, const float4& b, float blue,
                             float min_distance_sq, Vec3& sum, float& lost) {
  const Vec3 travel = receiver.position - Vec3{a.x, a.y, a.z};
  const float distance_sq = length_sq(travel), cosines = pair_cosines<flat>(receiver, {b.x, b.y, b.z}, travel);
  const float factor = cosines * inverse(fmaf(distance_sq, fmaxf(distance_sq, min_distance_sq), kTinyDistance4));
  const Vec3 intensity{a.w, b.w, blue};
  sum += intensity * factor;
  if (distance_sq < min_distance_sq) {
    lost += luminance(intensity) * (cosines * inverse(distance_sq * distance_sq + kTinyDistance4) - factor);
  }
}

/// Adds one VPL that is farther than the clamp.
template <bool flat>
__device__ inline void add_far_vpl(const FlatReceiver& receiver, const float4& a, const float4& b, float blue,
                                   Vec3& sum) {
  const Vec3 travel = receiver.position - Vec3{a.x, a.y, a.z};
  const float distance_sq = length_sq(travel);
  const float factor = pair_cosines<flat>(receiver, {b.x, b.y, b.z}, travel) * inverse(distance_sq * distance_sq);
  sum.x = fmaf(a.w, factor, sum.x);
  sum.y = fmaf(b.w, factor, sum.y);
  sum.z = fmaf(blue, factor, sum.z);
}

template <bool flat>
__device__ inline void add_block(const FlatReceiver (&receivers)[kPixelsEach], const StagedVpls& lights,
                                 std::uint32_t count, float min_distance_sq, Vec3 (&sums)[kPixelsEach],
                                 float (&lost)[kPixelsEach]) {
#pragma unroll 2
  for (std::uint32_t i = 0; i < count; ++i) {
    const float4 a = lights.position_red[i], b = lights.axis_green[i];
    const float2 c = lights.blue_near[i];
    if (c.y == 0) {
#pragma unroll
      for (int k = 0; k < kPixelsEach; ++k) add_far_vpl<flat>(receivers[k], a, b, c.x, sums[k]);
    } else {
#pragma unroll
      for (int k = 0; k < kPixelsEach; ++k) {
        add_near_vpl<flat>(receivers[k], a, b, c.x, min_distance_sq, sums[k], lost[k]);
      }
    }
  }
}

__device__ inline Box warp_union(Box box) {
#pragma unroll
  for (int step = 16; step > 0; step /= 2) {
    box = extend(box, Box{{__shfl_xor_sync(~0u, box.lo.x, step), __shfl_xor_sync(~0u, box.lo.y, step),
                           __shfl_xor_sync(~0u, box.lo.z, step)},
                          {__shfl_xor_sync(~0u, box.hi.x, step), __shfl_xor_sync(~0u, box.hi.y, step),
                           __shfl_xor_sync(~0u, box.hi.z, step)}});
  }
  return box;
}

/// Puts lights where the block's threads read them.
__device__ inline void stage_vpls(const Vpl* lights, std::uint32_t count, const Box& pixels, float near_sq,
                                  StagedVpls& staged) {
  for (std::uint32_t i = threadIdx.x; i < count; i += kFlatThreads) {
    const Vpl light = lights[i];
    const Vec3 gap = max_of(max_of(pixels.lo - light.position, light.position - pixels.hi), Vec3{});
    staged.position_red[i] = {light.position.x, light.position.y, light.position.z, light.intensity.x};
    staged.axis_green[i] = {light.axis.x, light.axis.y, light.axis.z, light.intensity.y};
    staged.blue_near[i] = {light.intensity.z, length_sq(gap) < near_sq ? 1.0f : 0.0f};
  }
}

__global__ void __launch_bounds__(kFlatThreads, 3)
    sum_vpls_kernel(PixelView pixels, std::uint32_t slots, const Vpl* __restrict__ lights, std::uint32_t first,
                    std::uint32_t last, float min_distance_sq, SumView sums) {
  __shared__ StagedVpls staged;
  __shared__ Box boxes[kFlatWarps];
  const std::uint32_t begin = blockIdx.x * (kFlatThreads * kPixelsEach) + threadIdx.x;
  FlatReceiver receivers[kPixelsEach];
  bool flat = true, lit[kPixelsEach];
  Box box;
#pragma unroll
  for (int k = 0; k < kPixelsEach; ++k) {
    const std::uint32_t slot = begin + static_cast<std::uint32_t>(k * kFlatThreads);
    const Vec3 ns = slot < slots ? pixels.ns[slot] : Vec3{};
    lit[k] = !(ns == Vec3{});
    if (lit[k]) {
      const Vec3 ng = pixels.ng[slot];
      receivers[k] = {pixels.position[slot], -ns, -ng};
      flat = flat && ns == ng;
      box = extend(box, receivers[k].position);
    }
  }
  flat = __all_sync(~0u, flat) != 0;
  box = warp_union(box);
  if (threadIdx.x % 32 == 0) boxes[threadIdx.x / 32] = box;
  __syncthreads();
#pragma unroll
  for (int w = 0; w < kFlatWarps; ++w) box = extend(box, boxes[w]);
  if (is_empty(box)) return;  // the whole block
#pragma unroll
  for (int k = 0; k < kPixelsEach; ++k) {
    // No light reaches these; at a place where nothing overflows.
    if (!lit[k]) receivers[k] = {box.lo, {}, {}};
  }
  const float near_sq = fmaxf(1.001f * min_distance_sq, kCarefulDistanceSq);
  Vec3T<double> total[kPixelsEach]{};
  double lost_total[kPixelsEach]{};
  for (std::uint32_t block = first; block < last; block += kBlockLights) {
    const std::uint32_t count = min_of(last - block, kBlockLights);
    __syncthreads();
    stage_vpls(lights + block, count, box, near_sq, staged);
    __syncthreads();
    Vec3 sum[kPixelsEach]{};
    float lost[kPixelsEach]{};
    if (flat) {
      add_block<true>(receivers, staged, count, min_distance_sq, sum, lost);
    } else {
      add_block<false>(receivers, staged, count, min_distance_sq, sum, lost);
    }
#pragma unroll
    for (int k = 0; k < kPixelsEach; ++k) {
      total[k] += Vec3T<double>{sum[k].x, sum[k].y, sum[k].z};
      lost_total[k] += lost[k];
    }
  }
#pragma unroll
  for (int k = 0; k < kPixelsEach; ++k) {
    if (!lit[k]) continue;
    const std::uint32_t slot = begin + static_cast<std::uint32_t>(k * kFlatThreads);
    sums.light[slot] += total[k];
    sums.lost[slot] += lost_total[k];
  }
}

void start_flat(Device& device, const PixelView& pixels, std::uint32_t slots, const Vpl* vpls, std::uint32_t first,
                std::uint32_t last, float min_distance_sq, const SumView& sums) {
  constexpr std::uint32_t pixels_a_block = kFlatThreads * kPixelsEach;
  sum_vpls_kernel<<<(slots + pixels_a_block - 1) / pixels_a_block, kFlatThreads, 0, device.stream()>>>(
      pixels, slots, vpls, first, last, min_distance_sq, sums);
}

template <class Ops>
void sum_lights(Device& device, const TracedScene& traced, const PixelGrid& grid, const PixelView& pixels,
                const typename Ops::Light* lights, std::uint32_t count, bool shadow_rays, float min_distance,
                const SumView& sums) {
  const std::uint32_t slots = grid.slot_count();
  const std::uint32_t blocks = (slots + kSumThreads - 1) / kSumThreads;
  // About a tenth of a second a launch on a slow GPU: 1e11 unshadowed pairs or 1e9 rays a second.
  const std::uint64_t pairs = shadow_rays ? 100'000'000u : 10'000'000'000u;
  const auto batch = static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(pairs / slots / kBlockLights * kBlockLights, kBlockLights, 1u << 30));
  const DeviceTracer tracer{traced.scene, traced.bvh};
  for (std::uint32_t first = 0; first < count; first += batch) {
    const std::uint32_t last = std::min(count, first + batch);
    if (shadow_rays) {
      sum_kernel<Ops, true><<<blocks, kSumThreads, 0, device.stream()>>>(tracer, pixels, slots, lights, first, last,
                                                                         min_distance * min_distance, sums);
    } else if constexpr (std::is_same_v<Ops, VplOps>) {
      start_flat(device, pixels, slots, lights, first, last, min_distance * min_distance, sums);
    } else {
      sum_kernel<Ops, false><<<blocks, kSumThreads, 0, device.stream()>>>(tracer, pixels, slots, lights, first, last,
                                                                          min_distance * min_distance, sums);
    }
    check(cudaGetLastError(), "summing lights");
  }
}

}  // namespace

void sum_all_lights(Device& device, const TracedScene& traced, const PixelGrid& grid, const PixelView& pixels,
                    const LightArrays& lights, bool shadow_rays, float min_distance, const SumView& sums) {
  sum_lights<VplOps>(device, traced, grid, pixels, lights.vpls, lights.vpl_count, shadow_rays, min_distance, sums);
  sum_lights<PointOps>(device, traced, grid, pixels, lights.points, lights.point_count, shadow_rays, min_distance,
                       sums);
  sum_lights<DirectionalOps>(device, traced, grid, pixels, lights.directionals, lights.directional_count, shadow_rays,
                             min_distance, sums);
}

}  // namespace lightcuts::cuda
