#include "cuda/map_sum_kernels.h"

#include <algorithm>

#include "cuda/flat_group.cuh"
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

// --- VPLs: one thread a pixel, lights through shared memory ---

/// A VPL and its map as the inner loop reads them, 16 bytes at a time; the axis is the map's.
struct alignas(16) LitVpl {
  Vec3 position;
  float unused;
  Vec3 z;
  float steps;  ///< as MapRecord
  Vec3 x;
  float bias_steps;
  Vec3 y;
  std::uint32_t has_map;  ///< 0: all of its light arrives
  Vec3 intensity;
  float padding;
  const void* codes;
};

/// A pixel as the inner loop reads it; the normals are negated, towards the way that light comes.
struct LitPixel {
  Vec3 position, ns, ng;
};

template <class Depth>
__device__ LitVpl load_vpl(const Vpl* lights, const MapSetView& maps, std::uint32_t i) {
  LitVpl lit{};
  const Vpl light = lights[i];
  lit.position = light.position;
  lit.intensity = light.intensity;
  lit.z = light.axis;
  const std::uint32_t slot = maps.vpl_slots[i];
  lit.has_map = slot == kNone ? 0 : 1;
  if (slot == kNone) return lit;
  const MapRecord map = maps.records[slot];
  lit.z = map.z;
  lit.steps = map.steps;
  lit.x = map.x;
  lit.bias_steps = map.bias_steps;
  lit.y = map.y;
  lit.codes = static_cast<const Depth*>(maps.codes) + static_cast<std::size_t>(slot) * (maps.size * maps.size);
  return lit;
}

__device__ MapRecord map_of(const LitVpl& lit) {
  MapRecord map;
  map.origin =
      lit.position;  // and not from the map's own, or cosines had to be computed twice: they differ by rounding
  map.steps = lit.steps;
  map.x = lit.x;
  map.bias_steps = lit.bias_steps;
  map.y = lit.y;
  map.half_width = 0;
  map.z = lit.z;
  map.rim_sq = 1;
  return map;
}

/// What all pixels of a warp get of a VPL's light, or kEachItsOwn; 0 where it lies behind their surface.
/// @param group  of the pixels, with the normal turned away from the light's side
template <class Depth, int Size>
__device__ float share_of_warp(const FlatReceivers& group, bool flat, const LitVpl& lit, int size) {
  const float along = dot(group.ng, group.middle - lit.position);
  if (flat && along < -(2 * kFlatness * group.reach + 1e-6f * length(group.middle))) return 0;
  if (lit.has_map == 0) return 1;
  __builtin_assume(__isGlobal(lit.codes));
  return look_up_group<Depth, Size>(map_of(lit), group, size, static_cast<const Depth*>(lit.codes));
}

__device__ float positive(float v) { return fmaxf(v, 0.0f); }

/// What arrives at a pixel of a VPL's light before anything hides it, and how.
struct Arriving {
  Vec3 travel;      ///< from the light [m]
  float cos_light;  ///< times the distance
  float along;      ///< the geometric normal and the way, times the distance
  float distance_sq, factor;
};

/// `flat`: both of the pixel's normals agree. A factor of 0 where no light arrives.
template <bool flat>
__device__ Arriving arriving(const LitPixel& pixel, const LitVpl& lit, float min_distance_sq) {
  Arriving a;
  a.travel = pixel.position - lit.position;
  a.cos_light = dot(lit.z, a.travel);
  const float cos_receiver = dot(pixel.ns, a.travel);
  a.along = flat ? cos_receiver : dot(pixel.ng, a.travel);
  a.distance_sq = length_sq(a.travel);
  const float cosines = flat || a.along > 0 ? positive(a.cos_light) * positive(cos_receiver) : 0.0f;
  a.factor = cosines * lightcuts::detail::quick_reciprocal(
                           a.distance_sq * lightcuts::detail::larger(a.distance_sq, min_distance_sq) + kTinyDistance4);
  return a;
}

__device__ void add_share(const LitVpl& lit, const Arriving& a, float share, float min_distance_sq, Sums& sums) {
  const float factor = a.factor * share;
  sums.block.x = fmaf(lit.intensity.x, factor, sums.block.x);
  sums.block.y = fmaf(lit.intensity.y, factor, sums.block.y);
  sums.block.z = fmaf(lit.intensity.z, factor, sums.block.z);
  if (a.distance_sq < min_distance_sq) {
    // What the clamp takes: the factor without it is as many times larger.
    const float clamped = a.distance_sq * min_distance_sq + kTinyDistance4;
    const float whole = a.distance_sq * a.distance_sq + kTinyDistance4;
    sums.block_lost += luminance(lit.intensity) * (factor * (clamped / whole - 1));
  }
}

/// The lights of a tile of which anything arrives. Each lane first looks at one of them for all of the warp's pixels; then those
/// are added of which the share is known, two at a time, and those that each pixel has to look at.
template <class Depth, int Size, bool flat>
__device__ void add_tile(const LitPixel& pixel, const FlatReceivers& group, const LitVpl* tile, std::uint32_t count,
                         int size, float min_distance_sq, Sums& sums) {
  const std::uint32_t lane = threadIdx.x % 32;
  const float own = lane < count ? share_of_warp<Depth, Size>(group, flat, tile[lane], size) : 0.0f;
  const auto take = [](unsigned& left) {
    const int i = __ffs(static_cast<int>(left)) - 1;
    left &= left - 1;
    return i;
  };
  for (unsigned known = __ballot_sync(kAllLanes, own > 0); known != 0;) {
    const int i = take(known), j = known != 0 ? take(known) : -1;
    const LitVpl &first = tile[i], &second = tile[j < 0 ? i : j];
    const float share = __shfl_sync(kAllLanes, own, i), other = j < 0 ? 0.0f : __shfl_sync(kAllLanes, own, j);
    const Arriving a = arriving<flat>(pixel, first, min_distance_sq);
    const Arriving b = arriving<flat>(pixel, second, min_distance_sq);
    add_share(first, a, share, min_distance_sq, sums);
    add_share(second, b, other, min_distance_sq, sums);
  }
  for (unsigned left = __ballot_sync(kAllLanes, own < 0); left != 0;) {
    const LitVpl& lit = tile[take(left)];
    const Arriving a = arriving<flat>(pixel, lit, min_distance_sq);
    if (!(a.factor > 0)) continue;
    const Vec3 local{dot(a.travel, lit.x), dot(a.travel, lit.y), a.cos_light};
    const Vec3 normal{dot(pixel.ng, lit.x), dot(pixel.ng, lit.y), dot(pixel.ng, lit.z)};
    __builtin_assume(__isGlobal(lit.codes));  // or its loads would be those that look for shared memory too
    const float share = look_up_facing<Depth, Size>(map_of(lit), local, normal, a.distance_sq, a.along, size,
                                                    static_cast<const Depth*>(lit.codes));
    add_share(lit, a, share, min_distance_sq, sums);
  }
}

template <class Depth, int Size>
__global__ void __launch_bounds__(kThreads, 10)
    sum_vpls_kernel(PixelView pixels, std::uint32_t slots, const Vpl* __restrict__ lights, std::uint32_t first,
                    std::uint32_t last, MapSetView maps, float min_distance_sq, SumView out) {
  __shared__ __align__(16) unsigned char storage[kTileLights * sizeof(LitVpl)];
  __shared__ FlatReceivers groups[kThreads / 32];
  auto* const tile = reinterpret_cast<LitVpl*>(storage);
  const std::uint32_t slot = blockIdx.x * kThreads + threadIdx.x;
  const bool inside = slot < slots;
  LitPixel pixel{};
  Sums sums;
  if (inside) {
    pixel = {pixels.position[slot], -pixels.ns[slot], -pixels.ng[slot]};
    sums.total = out.light[slot];
    sums.lost = out.lost[slot];
  }
  const bool seen = !(pixel.ns == Vec3{});
  const bool flat = __all_sync(kAllLanes, pixel.ns == pixel.ng) != 0;
  const unsigned seeing = __ballot_sync(kAllLanes, seen);
  FlatReceivers& group = groups[threadIdx.x / 32];
  {
    const FlatReceivers of_all = flat_receivers(seeing == 0 ? kAllLanes : seeing, pixel.position, pixel.ng);
    if (threadIdx.x % 32 == 0) group = of_all;
  }
  for (std::uint32_t begin = first; begin < last; begin += kTileLights) {
    __syncthreads();
    if (threadIdx.x < kTileLights) {
      tile[threadIdx.x] = begin + threadIdx.x < last ? load_vpl<Depth>(lights, maps, begin + threadIdx.x) : LitVpl{};
    }
    __syncthreads();
    if (seeing != 0) {
      const std::uint32_t count = min_of(kTileLights, last - begin);
      if (flat) {
        add_tile<Depth, Size, true>(pixel, group, tile, count, maps.size, min_distance_sq, sums);
      } else {
        add_tile<Depth, Size, false>(pixel, group, tile, count, maps.size, min_distance_sq, sums);
      }
    }
    if ((begin + kTileLights - first) % kBlockLights == 0) sums.close_block();
  }
  sums.close_block();
  if (!inside) return;
  out.light[slot] = sums.total;
  out.lost[slot] = sums.lost;
}

// --- Other lights: one thread a pixel ---

__device__ PixelReceiver load_receiver(const PixelView& pixels, std::uint32_t slot) {
  return {pixels.position[slot], pixels.ns[slot], pixels.ng[slot]};
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
  const PixelReceiver receiver = load_receiver(pixels, slot);
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
