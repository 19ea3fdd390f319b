#include "cuda/map_sum_kernels.h"

#include <algorithm>

#include "cuda/flat_group.cuh"
#include "kernels/light.h"

namespace lightcuts::cuda {
namespace {

constexpr int kThreads = 128;
constexpr std::uint32_t kBlockLights = 256;  ///< summed in single precision before they go into the total
constexpr std::uint32_t kTileLights = 32;    ///< that a warp looks at together
/// About a tenth of a second a launch on a slow GPU.
constexpr std::uint64_t kLaunchPairs = 2'000'000'000u;

using PixelReceiver = Receiver<float>;

/// A pixel's running sums of a block of lights.
struct Sums {
  Vec3 block{};
  float block_lost = 0;

  /// Adds them to the pixel's total. Rarely done: that one stays in memory, where it takes no registers.
  __device__ void close_block(const SumView& out, std::uint32_t slot, bool inside) {
    if (inside) {
      out.light[slot] += Vec3T<double>{block.x, block.y, block.z};
      out.lost[slot] += block_lost;
    }
    block = {};
    block_lost = 0;
  }
};

// --- VPLs: one thread a pixel, lights through shared memory ---

/// A VPL and its map as the loops read them, 16 bytes at a time; the axis is the map's.
struct alignas(16) LitVpl {
  Vec3 position;
  std::uint32_t slot;  ///< of its map, kNone: all of its light arrives
  Vec3 z;
  float steps;  ///< as MapRecord
  Vec3 x;
  float bias_steps;
  Vec3 y;
  float unused;
  Vec3 intensity;
  float padding;
};

/// A pixel as the inner loop reads it; the normals are negated, towards the way that light comes.
struct LitPixel {
  Vec3 position, ns, ng;
};

/// Lights a launch, whose copies are made before.
constexpr std::uint32_t kLaunchLights = 1u << 13;

__global__ void __launch_bounds__(kThreads)
    pack_vpls_kernel(const Vpl* __restrict__ lights, std::uint32_t first, std::uint32_t count, MapSetView maps,
                     LitVpl* __restrict__ packed) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= count) return;
  const Vpl light = lights[first + i];
  LitVpl lit{};
  lit.position = light.position;
  lit.intensity = light.intensity;
  lit.z = light.axis;
  lit.slot = maps.vpl_slots[first + i];
  if (lit.slot != kNone) {
    const MapRecord map = maps.records[lit.slot];
    lit.z = map.z;
    lit.steps = map.steps;
    lit.x = map.x;
    lit.bias_steps = map.bias_steps;
    lit.y = map.y;
  }
  packed[i] = lit;
}

/// Reads a light, and again where it is called again: registers are worth more here than loads.
__device__ LitVpl read_vpl(const LitVpl* from) {
  float4 w[5];
#pragma unroll
  for (int i = 0; i < 5; ++i) {
    asm volatile("ld.global.nc.v4.f32 {%0, %1, %2, %3}, [%4];"
                 : "=f"(w[i].x), "=f"(w[i].y), "=f"(w[i].z), "=f"(w[i].w)
                 : "l"(reinterpret_cast<const float4*>(from) + i));
  }
  const auto vector = [&](int i) { return Vec3{w[i].x, w[i].y, w[i].z}; };
  return {vector(0), __float_as_uint(w[0].w), vector(1), w[1].w, vector(2), w[2].w, vector(3), w[3].w, vector(4),
          w[4].w};
}

template <class Depth, int Size>
__device__ const Depth* codes_of(const MapSetView& maps, std::uint32_t slot) {
  const int size = Size > 0 ? Size : maps.size;
  return static_cast<const Depth*>(maps.codes) + static_cast<std::size_t>(slot) * (size * size);
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

/// What all pixels of a warp get of a VPL's light.
struct WarpLook {
  std::uint32_t texels;  ///< see look_up_group_texels
  bool plain;  ///< it lies before all of their surface and they before it, and none is so near that it is clamped
};

/// @param group  of the pixels, with the normal turned away from the light's side
template <class Depth, int Size>
__device__ WarpLook look_of_warp(const FlatReceivers& group, bool flat, const LitVpl& lit, const MapSetView& maps,
                                 float min_distance) {
  const Vec3 way = group.middle - lit.position;
  const float along = dot(group.ng, way), slack = 2 * kFlatness * group.reach + 1e-6f * length(group.middle);
  if (flat && along < -slack) return {0, false};
  if (lit.slot == kNone) return {kGroupTexels, false};
  const std::uint32_t texels =
      look_up_group_texels<Depth, Size>(map_of(lit), group, maps.size, codes_of<Depth, Size>(maps, lit.slot));
  const float near = group.reach + min_distance;
  return {texels, along > slack && dot(way, way) > 1.001f * near * near};
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

/// A light of which all arrives at all pixels of a warp.
struct alignas(16) PlainVpl {
  Vec3 position;
  float unused;
  Vec3 axis;
  float padding;
  Vec3 intensity;
  float more_padding;
};

/// A light of which each pixel's place tells its share.
struct alignas(16) PlacedVpl {
  Vec3 position;
  float first_x;  ///< the map's middle, in texels from the word's first
  Vec3 axis;
  float first_y;
  Vec3 x;  ///< axes of the map, half a map long in texels
  std::uint32_t texels;
  Vec3 y;
  float unused;
  Vec3 intensity;
  float padding;
};

/// What a warp has of a block's shared memory.
struct alignas(16) WarpRoom {
  /// Lights that it has sorted out: first those by place, then the plain ones.
  uint4 words[kTileLights * sizeof(PlacedVpl) / sizeof(uint4)];
  std::uint32_t waiting[2 * kTileLights];  ///< lights that may arrive
  __device__ PlacedVpl* placed() { return reinterpret_cast<PlacedVpl*>(words); }
  __device__ PlainVpl* plain(int placed_count) { return reinterpret_cast<PlainVpl*>(placed() + placed_count); }
};

__device__ void add_light(Vec3 intensity, float factor, Sums& sums) {
  sums.block.x = fmaf(intensity.x, factor, sums.block.x);
  sums.block.y = fmaf(intensity.y, factor, sums.block.y);
  sums.block.z = fmaf(intensity.z, factor, sums.block.z);
}

/// What arrives of a plain light before anything hides it: no limit has to be minded.
struct PlainWay {
  Vec3 travel;      ///< from the light [m]
  float cos_light;  ///< times the distance
  float distance_sq, factor;
};
template <bool flat>
__device__ PlainWay plain_way(const LitPixel& pixel, Vec3 position, Vec3 axis) {
  PlainWay way;
  way.travel = pixel.position - position;
  way.cos_light = dot(axis, way.travel);
  way.distance_sq = length_sq(way.travel);
  const float cos_receiver = dot(pixel.ns, way.travel);
  const float cosines = way.cos_light * (flat ? cos_receiver : positive(cos_receiver));
  way.factor = cosines * lightcuts::detail::quick_reciprocal(way.distance_sq * way.distance_sq + kTinyDistance4);
  return way;
}

/// Lights of which all arrives at all pixels of a warp: by much the most, and what is told of them leaves little to do.
template <bool flat>
__device__ void add_plain(const LitPixel& pixel, const PlainVpl* lights, int count, Sums& sums) {
#pragma unroll 4
  for (int i = 0; i < count; ++i) {
    const PlainVpl& light = lights[i];
    add_light(light.intensity, plain_way<flat>(pixel, light.position, light.axis).factor, sums);
  }
}

template <bool flat>
__device__ void add_placed(const LitPixel& pixel, const PlacedVpl* lights, int count, Sums& sums) {
#pragma unroll 2
  for (int i = 0; i < count; ++i) {
    const PlacedVpl& light = lights[i];
    const PlainWay way = plain_way<flat>(pixel, light.position, light.axis);
    const float distance = way.distance_sq * lightcuts::detail::quick_inverse_root(way.distance_sq + kTinyDistance4);
    const float scale = lightcuts::detail::quick_reciprocal(distance + way.cos_light);
    const float x = dot(way.travel, light.x) * scale + light.first_x,
                y = dot(way.travel, light.y) * scale + light.first_y;
    add_light(light.intensity, way.factor * share_by_place(light.texels, x, y), sums);
  }
}

/// False where no light can arrive at a group: it lies behind the light, or the light behind its surface.
__device__ bool may_arrive(const FlatReceivers& group, bool flat, const LitVpl* light) {
  if (!(group.reach < kInfinity)) return true;
  const auto* const words = reinterpret_cast<const float4*>(light);
  const float4 position = __ldg(words), axis = __ldg(words + 1);
  const Vec3 way = group.middle - Vec3{position.x, position.y, position.z}, z{axis.x, axis.y, axis.z};
  const float height = fabsf(dot(group.half_a, z)) + fabsf(dot(group.half_b, z));
  const float slack = 2 * kFlatness * group.reach + 1e-6f * length(group.middle);
  return !(flat && dot(group.ng, way) < -slack) && !(dot(way, z) + 1.01f * height + group.off < 0);
}

/// Adds the first `count` lights that wait, one a lane. Each lane first looks at its own for all of the warp's pixels. Then those
/// are added of which all arrives, those of which each pixel's place tells its share, and those that each looks at.
template <class Depth, int Size, bool flat>
__device__ void add_lights(const LitPixel& pixel, const FlatReceivers& group, const LitVpl* lights, std::uint32_t count,
                           const MapSetView& maps, float min_distance, WarpRoom& room, Sums& sums) {
  const std::uint32_t lane = threadIdx.x % 32, before = (1u << lane) - 1u;
  const LitVpl* const mine = lights + room.waiting[min_of(lane, count - 1)];
  WarpLook own{0, false};
  if (lane < count) own = look_of_warp<Depth, Size>(group, flat, read_vpl(mine), maps, min_distance);
  const bool is_plain = own.plain && own.texels == kGroupTexels;
  const bool is_placed = own.plain && !is_plain && own.texels != 0 && own.texels != kGroupUnsure;
  const unsigned all_plain = __ballot_sync(kAllLanes, is_plain), all_placed = __ballot_sync(kAllLanes, is_placed);
  const int plain_count = __popc(all_plain), placed_count = __popc(all_placed);
  __syncwarp();
  if (is_plain) {
    const LitVpl lit = read_vpl(mine);
    room.plain(placed_count)[__popc(all_plain & before)] = {lit.position, 0, lit.z, 0, lit.intensity, 0};
  }
  if (is_placed) {
    const LitVpl lit = read_vpl(mine);
    const float half = 0.5f * static_cast<float>(Size > 0 ? Size : maps.size);
    const float first_x = half - 0.5f - static_cast<float>(group_column(own.texels));
    const float first_y = half - 0.5f - static_cast<float>(group_row(own.texels));
    room.placed()[__popc(all_placed & before)] = {lit.position, first_x,      lit.z, first_y,       lit.x * half,
                                                  own.texels,   lit.y * half, 0,     lit.intensity, 0};
  }
  __syncwarp();
  add_plain<flat>(pixel, room.plain(placed_count), plain_count, sums);
  add_placed<flat>(pixel, room.placed(), placed_count, sums);
  const unsigned looking = __ballot_sync(kAllLanes, own.texels != 0 && !is_plain && !is_placed);
  for (unsigned left = looking; left != 0; left &= left - 1) {
    const LitVpl other = read_vpl(lights + room.waiting[__ffs(static_cast<int>(left)) - 1]);
    const float min_distance_sq = min_distance * min_distance;
    const Arriving a = arriving<flat>(pixel, other, min_distance_sq);
    if (!(a.factor > 0)) continue;
    float share = 1;
    if (other.slot != kNone) {
      const Vec3 local{dot(a.travel, other.x), dot(a.travel, other.y), a.cos_light};
      const Vec3 normal{dot(pixel.ng, other.x), dot(pixel.ng, other.y), dot(pixel.ng, other.z)};
      share = look_up_facing<Depth, Size>(map_of(other), local, normal, a.distance_sq, a.along, maps.size,
                                          codes_of<Depth, Size>(maps, other.slot));
    }
    add_share(other, a, share, min_distance_sq, sums);
  }
}

/// Adds the lights from `first` to before `last`. Those that may arrive wait until there is one for every lane.
template <class Depth, int Size, bool flat>
__device__ void add_block(const LitPixel& pixel, const FlatReceivers& group, const LitVpl* lights, std::uint32_t first,
                          std::uint32_t last, const MapSetView& maps, float min_distance, WarpRoom& room, Sums& sums) {
  const std::uint32_t lane = threadIdx.x % 32;
  std::uint32_t count = 0;
  for (std::uint32_t begin = first; begin < last; begin += kTileLights) {
    const bool may = begin + lane < last && may_arrive(group, flat, lights + begin + lane);
    const unsigned all = __ballot_sync(kAllLanes, may);
    if (may) room.waiting[count + static_cast<std::uint32_t>(__popc(all & ((1u << lane) - 1u)))] = begin + lane;
    count += static_cast<std::uint32_t>(__popc(all));
    __syncwarp();
    const bool ends = begin + kTileLights >= last;
    while (count >= kTileLights || (ends && count > 0)) {
      const std::uint32_t here = min_of(kTileLights, count);
      add_lights<Depth, Size, flat>(pixel, group, lights, here, maps, min_distance, room, sums);
      count -= here;
      __syncwarp();
      const std::uint32_t next = lane < count ? room.waiting[kTileLights + lane] : 0;
      __syncwarp();
      if (lane < count) room.waiting[lane] = next;
      __syncwarp();
    }
  }
}

/// The pixels of a warp that lie in one plane; those in another have a turn of their own, if they all do.
struct PlaneGroups {
  unsigned lanes;
  int count;
};
__device__ PlaneGroups plane_groups(unsigned seeing, Vec3 position, Vec3 ng) {
  if (flat_receivers(seeing, position, ng).reach < kInfinity) return {seeing, 1};
  const int leader = __ffs(static_cast<int>(seeing)) - 1;
  const Vec3 first = from_lane(position, leader), normal = from_lane(ng, leader), way = position - first,
             turned = ng - normal;
  const float off = fabsf(dot(way, normal)), slack = 1e-4f * length(way) + 1e-6f * max_component(max_of(first, -first));
  const unsigned lanes = seeing & __ballot_sync(kAllLanes, dot(turned, turned) < 1e-10f && off <= slack);
  if ((seeing & ~lanes) == 0 || !(flat_receivers(lanes, position, ng).reach < kInfinity) ||
      !(flat_receivers(seeing & ~lanes, position, ng).reach < kInfinity)) {
    return {seeing, 1};
  }
  return {lanes, 2};
}

template <class Depth, int Size>
__global__ void __launch_bounds__(kThreads, 8)
    sum_vpls_kernel(PixelView pixels, std::uint32_t slots, const LitVpl* __restrict__ lights, std::uint32_t count,
                    MapSetView maps, float min_distance, SumView out) {
  __shared__ FlatReceivers groups[kThreads / 32];
  __shared__ WarpRoom rooms[kThreads / 32];
  const std::uint32_t slot = blockIdx.x * kThreads + threadIdx.x;
  const bool inside = slot < slots;
  LitPixel pixel{};
  Sums sums;
  if (inside) {
    pixel = {pixels.position[slot], -pixels.ns[slot], -pixels.ng[slot]};
  }
  const bool seen = !(pixel.ns == Vec3{});
  const bool flat = __all_sync(kAllLanes, pixel.ns == pixel.ng) != 0;
  const unsigned seeing = __ballot_sync(kAllLanes, seen);
  if (seeing == 0) return;
  FlatReceivers& group = groups[threadIdx.x / 32];
  const PlaneGroups planes = plane_groups(seeing, pixel.position, pixel.ng);
  for (int pass = 0; pass < planes.count; ++pass) {
    const unsigned lanes = pass == 0 ? planes.lanes : seeing & ~planes.lanes;
    const LitPixel own = (lanes >> threadIdx.x % 32 & 1u) != 0 ? pixel : LitPixel{pixel.position, {}, {}};
    const FlatReceivers of_all = flat_receivers(lanes, pixel.position, pixel.ng);
    __syncwarp();
    if (threadIdx.x % 32 == 0) group = of_all;
    __syncwarp();
    WarpRoom& room = rooms[threadIdx.x / 32];
    for (std::uint32_t first = 0; first < count; first += kBlockLights) {
      const std::uint32_t last = min_of(first + kBlockLights, count);
      if (flat) {
        add_block<Depth, Size, true>(own, group, lights, first, last, maps, min_distance, room, sums);
      } else {
        add_block<Depth, Size, false>(own, group, lights, first, last, maps, min_distance, room, sums);
      }
      sums.close_block(out, slot, inside);
    }
  }
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
  for (std::uint32_t i = first; i < last; ++i) {
    const float factor = term.factor(receiver, i);
    if (factor > 0) sums.block += term.intensity(i) * (factor * term.share(maps, i, receiver));
    if ((i + 1 - first) % kBlockLights == 0) sums.close_block(out, slot, true);
  }
  sums.close_block(out, slot, true);
}

using SumVpls = void (*)(PixelView, std::uint32_t, const LitVpl*, std::uint32_t, MapSetView, float, SumView);

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
      std::clamp<std::uint64_t>(kLaunchPairs / slots / kBlockLights * kBlockLights, kBlockLights, kLaunchLights));
  for (; first < last; first += std::min(step, last - first)) {
    launch(first, first + std::min(step, last - first));
    check(cudaGetLastError(), "summing lights by their shadow maps");
  }
}

}  // namespace

void sum_lights_by_maps(Device& device, const PixelGrid& grid, const PixelView& pixels, const LightArrays& lights,
                        const LightSpan& span, const MapSetView& maps, float min_distance, const SumView& sums) {
  const std::uint32_t slots = grid.slot_count(), blocks = (slots + kThreads - 1) / kThreads;
  DeviceBuffer<LitVpl> packed(device, std::min(kLaunchLights, span.vpl_last - span.vpl_first));
  static_assert(sizeof(LitVpl) * kLaunchLights <= kSumByMapsBytes);
  in_launches(slots, span.vpl_first, span.vpl_last, [&](std::uint32_t first, std::uint32_t last) {
    const std::uint32_t count = last - first;
    pack_vpls_kernel<<<(count + kThreads - 1) / kThreads, kThreads, 0, device.stream()>>>(lights.vpls, first, count,
                                                                                          maps, packed.data());
    kernel_for(maps)<<<blocks, kThreads, 0, device.stream()>>>(pixels, slots, packed.data(), count, maps, min_distance,
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
