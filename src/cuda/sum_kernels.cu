#include <algorithm>

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
    const std::uint32_t end = min(last, block + kBlockLights);
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
