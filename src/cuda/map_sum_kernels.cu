#include "cuda/map_sum_kernels.h"

#include <algorithm>

#include "kernels/light.h"

namespace lightcuts::cuda {
namespace {

constexpr int kThreads = 128;
constexpr std::uint32_t kBlockLights = 256;  ///< summed in single precision before they go into the total
constexpr std::uint32_t kTileLights = 32;    ///< that a block of threads has in shared memory at a time
/// About a tenth of a second a launch on a slow GPU.
constexpr std::uint64_t kLaunchPairs = 2'000'000'000u;

using PixelReceiver = Receiver<float>;

/// A pixel's running sums.
struct Sums {
  Vec3 block{};
  float block_lost = 0;
  Vec3T<double> total{};
  double lost = 0;

  __device__ void close_block() {
    total += Vec3T<double>{block.x, block.y, block.z};
    lost += block_lost;
    block = {};
    block_lost = 0;
  }
};

/// A VPL and its map as the inner loop reads them; the axis is the map's.
struct alignas(16) LitVpl {
  Vec3 position;
  float unused;
  Vec3 intensity;
  std::uint32_t slot;  ///< kNone: no map, all of its light arrives
  MapRecord map;
};

__device__ LitVpl load_vpl(const Vpl* lights, const MapSetView& maps, std::uint32_t i) {
  LitVpl lit;
  const Vpl light = lights[i];
  lit.position = light.position;
  lit.intensity = light.intensity;
  const std::uint32_t slot = maps.vpl_slots[i];
  lit.slot = slot;
  if (slot == kNone) {
    lit.map.z = light.axis;
  } else {
    lit.map = maps.records[slot];
  }
  return lit;
}

template <class Depth, int Size>
__device__ void add_vpl(const PixelReceiver& receiver, const LitVpl& lit, const MapSetView& maps, float min_distance_sq,
                        Sums& sums) {
  const VplFactor<float> factor = vpl_factor(receiver, lit.position, lit.map.z, min_distance_sq);
  if (!(factor.clamped > 0)) return;
  float share = 1;
  if (lit.slot != kNone) {
    const int size = Size > 0 ? Size : maps.size;
    const Depth* const codes =
        static_cast<const Depth*>(maps.codes) + static_cast<std::size_t>(lit.slot) * (size * size);
    share = look_up_map<Depth, true, Size>(lit.map, to_map(lit.map, receiver.position), receiver.ng, size, codes);
  }
  sums.block += lit.intensity * (factor.clamped * share);
  if (factor.distance_sq < min_distance_sq) {
    // Without a clamp, computed here: it is rare.
    const float unclamped = vpl_factor(receiver, lit.position, lit.map.z, 0.0f).clamped;
    sums.block_lost += luminance(lit.intensity) * ((unclamped - factor.clamped) * share);
  }
}

/// One thread a pixel; a block of threads shares the lights that it loads.
template <class Depth, int Size>
__global__ void __launch_bounds__(kThreads, 8)
    sum_vpls_kernel(PixelView pixels, std::uint32_t slots, const Vpl* __restrict__ lights, std::uint32_t first,
                    std::uint32_t last, MapSetView maps, float min_distance_sq, SumView out) {
  __shared__ LitVpl tile[kTileLights];
  const std::uint32_t slot = blockIdx.x * kThreads + threadIdx.x;
  PixelReceiver receiver{};
  Sums sums;
  const bool inside = slot < slots;
  if (inside) {
    receiver = {pixels.position[slot], pixels.ns[slot], pixels.ng[slot]};
    sums.total = out.light[slot];
    sums.lost = out.lost[slot];
  }
  for (std::uint32_t begin = first; begin < last; begin += kTileLights) {
    const std::uint32_t count = min(last - begin, kTileLights);
    __syncthreads();
    if (threadIdx.x < count) tile[threadIdx.x] = load_vpl(lights, maps, begin + threadIdx.x);
    __syncthreads();
    for (std::uint32_t i = 0; i < count; ++i) add_vpl<Depth, Size>(receiver, tile[i], maps, min_distance_sq, sums);
    if ((begin + kTileLights - first) % kBlockLights == 0) sums.close_block();
  }
  sums.close_block();
  if (!inside) return;
  out.light[slot] = sums.total;
  out.lost[slot] = sums.lost;
}

struct PointTerm {
  const PointLight* lights;
  __device__ float factor(const PixelReceiver& receiver, std::uint32_t i) const {
    const PointLight& light = lights[i];
    const float range = max_of(light.cos_inner - light.cos_outer, 1e-6f);
    return point_factor(receiver, Spot<float>{light.position, light.axis, light.cos_outer, 1.0f / range});
  }
  __device__ Vec3 intensity(std::uint32_t i) const { return lights[i].intensity; }
  __device__ float share(const MapSetView& maps, std::uint32_t i, const PixelReceiver& receiver) const {
    return point_share(maps, i, lights[i].cos_outer, receiver.position, receiver.ng);
  }
};

struct DirectionalTerm {
  const DirectionalLight* lights;
  __device__ float factor(const PixelReceiver& receiver, std::uint32_t i) const {
    return directional_factor(receiver, lights[i].direction);
  }
  __device__ Vec3 intensity(std::uint32_t i) const { return lights[i].irradiance; }
  __device__ float share(const MapSetView& maps, std::uint32_t i, const PixelReceiver& receiver) const {
    return directional_share(maps, i, receiver.position, receiver.ng);
  }
};

template <class Term>
__global__ void __launch_bounds__(kThreads)
    sum_others_kernel(PixelView pixels, std::uint32_t slots, Term term, std::uint32_t first, std::uint32_t last,
                      MapSetView maps, SumView out) {
  const std::uint32_t slot = blockIdx.x * kThreads + threadIdx.x;
  if (slot >= slots) return;
  const PixelReceiver receiver = {pixels.position[slot], pixels.ns[slot], pixels.ng[slot]};
  if (receiver.ns == Vec3{}) return;
  Sums sums;
  sums.total = out.light[slot];
  for (std::uint32_t i = first; i < last; ++i) {
    const float factor = term.factor(receiver, i);
    if (factor > 0) sums.block += term.intensity(i) * (factor * term.share(maps, i, receiver));
    if ((i + 1 - first) % kBlockLights == 0) sums.close_block();
  }
  sums.close_block();
  out.light[slot] = sums.total;
}

using SumVpls = void (*)(PixelView, std::uint32_t, const Vpl*, std::uint32_t, std::uint32_t, MapSetView, float,
                         SumView);

SumVpls kernel_for(const MapSetView& maps) {
  if (maps.depth_bits == 32) return sum_vpls_kernel<std::uint32_t, 0>;
  switch (maps.size) {
    case 32:
      return sum_vpls_kernel<std::uint16_t, 32>;
    case 64:
      return sum_vpls_kernel<std::uint16_t, 64>;
    default:
      return sum_vpls_kernel<std::uint16_t, 0>;
  }
}

/// Calls launch(first, last) for parts of the range, each of whole blocks of lights.
template <class Launch>
void in_launches(std::uint32_t slots, std::uint32_t first, std::uint32_t last, const Launch& launch) {
  const auto step = static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(kLaunchPairs / slots / kBlockLights * kBlockLights, kBlockLights, 1u << 30));
  for (; first < last; first += std::min(step, last - first)) {
    launch(first, first + std::min(step, last - first));
    check(cudaGetLastError(), "summing lights by their shadow maps");
  }
}

}  // namespace

void sum_lights_by_maps(Device& device, const PixelGrid& grid, const PixelView& pixels, const LightArrays& lights,
                        const LightSpan& span, const MapSetView& maps, float min_distance, const SumView& sums) {
  const std::uint32_t slots = grid.slot_count(), blocks = (slots + kThreads - 1) / kThreads;
  const float min_sq = min_distance * min_distance;
  in_launches(slots, span.vpl_first, span.vpl_last, [&](std::uint32_t first, std::uint32_t last) {
    kernel_for(maps)<<<blocks, kThreads, 0, device.stream()>>>(pixels, slots, lights.vpls, first, last, maps, min_sq,
                                                               sums);
  });
  in_launches(slots, span.point_first, span.point_last, [&](std::uint32_t first, std::uint32_t last) {
    sum_others_kernel<<<blocks, kThreads, 0, device.stream()>>>(pixels, slots, PointTerm{lights.points}, first, last,
                                                                maps, sums);
  });
  in_launches(slots, span.directional_first, span.directional_last, [&](std::uint32_t first, std::uint32_t last) {
    sum_others_kernel<<<blocks, kThreads, 0, device.stream()>>>(pixels, slots, DirectionalTerm{lights.directionals},
                                                                first, last, maps, sums);
  });
}

}  // namespace lightcuts::cuda
