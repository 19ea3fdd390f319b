#include "cuda/map_sum_kernels.h"

#include <algorithm>

#include "cuda/pixel_planes.cuh"
#include "cuda/plane_lights.cuh"
#include "kernels/light.h"

namespace lightcuts::cuda {
namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;
constexpr int kEach = 2;                   ///< pixels a thread, of tiles one below the other
constexpr std::uint32_t kTileLights = 32;  ///< that a warp looks at together
/// About a tenth of a second a launch on a slow GPU.
constexpr std::uint64_t kLaunchPairs = 4'000'000'000u;

using PixelReceiver = Receiver<float>;

// --- VPLs: two pixels a thread, a block two tiles ---
//
// Issue slots bound this sum (docs/results/gpu.md counts them), so what can be said once for many pixels is: a warp looks at
// a light's map for all of its pixels, a lane at a light, and most lights then need no look by a pixel. The block's warps
// share its lights out among them: so a tile of which every pixel has to look by itself holds nobody up for long.

/// Blocks of lights a launch, and lights, whose copies are made before.
constexpr std::uint32_t kLaunchBlocks = 12, kLaunchLights = kLaunchBlocks * kSumBlockLights;

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
  GroupLook look;
  bool plain;  ///< it lies before all of their surface and they before it, and none is so near that it is clamped
};

template <class Depth, int Size>
__device__ WarpLook look_of_warp(const WarpPlane& plane, const LitVpl& lit, const MapSetView& maps) {
  if (lit.slot == kNone) return {{kGroupTexels, 0}, false};
  const GroupLook look =
      look_at_group<Depth, Size>(map_of(lit), plane.pixels, maps.size, codes_of<Depth, Size>(maps, lit.slot));
  const Vec3 way = plane.pixels.middle - lit.position;
  return {look, dot(plane.pixels.ng, way) > plane.least_along && dot(way, way) > plane.near_sq};
}

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

__device__ void add_share(const LitVpl& lit, const Arriving& a, float share, float min_distance_sq, PixelSum& sum) {
  const float factor = a.factor * share;
  sum.light.x = fmaf(lit.intensity.x, factor, sum.light.x);
  sum.light.y = fmaf(lit.intensity.y, factor, sum.light.y);
  sum.light.z = fmaf(lit.intensity.z, factor, sum.light.z);
  if (a.distance_sq < min_distance_sq) {
    // What the clamp takes: the factor without it is as many times larger.
    const float clamped = a.distance_sq * min_distance_sq + kTinyDistance4;
    const float whole = a.distance_sq * a.distance_sq + kTinyDistance4;
    sum.lost += luminance(lit.intensity) * (factor * (clamped / whole - 1));
  }
}

/// What a warp has of a block's shared memory.
struct alignas(16) WarpRoom {
  /// Lights that it has sorted out: first those by place, then the plain ones.
  uint4 words[kTileLights * sizeof(PlacedVpl) / sizeof(uint4)];
  std::uint32_t waiting[2 * kTileLights];  ///< lights that may arrive
  __device__ PlacedVpl* placed() { return reinterpret_cast<PlacedVpl*>(words); }
  __device__ PlainVpl* plain(int placed_count) { return reinterpret_cast<PlainVpl*>(placed() + placed_count); }
};

/// False where no light can arrive at a group: it lies behind the light, or the light behind its surface, or both so nearly in
/// one plane that what arrives is less than rounding: of both cosines' product less than 1e-8.
__device__ bool may_arrive(const WarpPlane& plane, bool flat, const LitVpl* light) {
  const FlatReceivers& group = plane.pixels;
  if (!(group.reach < kInfinity)) return true;
  const auto* const words = reinterpret_cast<const float4*>(light);
  const float4 position = __ldg(words), axis = __ldg(words + 1);
  const Vec3 way = group.middle - Vec3{position.x, position.y, position.z}, z{axis.x, axis.y, axis.z};
  const float height = fabsf(dot(group.half_a, z)) + fabsf(dot(group.half_b, z));
  const float faced = dot(way, z) + 1.01f * height + group.off;  // at most, and times the distance, as `along`
  if (!flat) return !(faced < 0);
  const float along = dot(group.ng, way), distance_sq = dot(way, way);
  const bool in_plane =
      (fabsf(along) + group.off) * faced < 5e-9f * distance_sq && 16 * group.reach * group.reach < distance_sq;
  return !(faced < 0) && !(along < -plane.slack) && !in_plane;
}

/// Adds the first `count` lights that wait, one a lane. Each lane first looks at its own for all of the warp's pixels. Then those
/// are added of which all arrives, those of which each pixel's place tells its share, and those that each looks at.
template <class Depth, int Size, bool flat>
__device__ void add_lights(const LitPixel (&pixels)[kEach], const PlanePixel (&in_plane)[kEach], const WarpPlane& plane,
                           const LitVpl* lights, std::uint32_t count, const MapSetView& maps, float min_distance,
                           WarpRoom& room, PixelSum (&sums)[kEach]) {
  const std::uint32_t lane = threadIdx.x % 32, before = (1u << lane) - 1u;
  const LitVpl* const mine = lights + room.waiting[min_of(lane, count - 1)];
  WarpLook own{{0, 0}, false};
  if (lane < count) own = look_of_warp<Depth, Size>(plane, read_vpl(mine), maps);
  const std::uint32_t texels = own.look.texels;
  const bool is_plain = own.plain && texels == kGroupTexels;
  const bool is_placed = own.plain && !is_plain && texels != 0 && texels != kGroupUnsure;
  const unsigned all_plain = __ballot_sync(kAllLanes, is_plain), all_placed = __ballot_sync(kAllLanes, is_placed);
  const unsigned all_one = __ballot_sync(kAllLanes, is_placed && __popc(own.look.own) == 1);
  const int plain_count = __popc(all_plain), placed_count = __popc(all_placed), one_count = __popc(all_one);
  __syncwarp();
  if (is_plain) room.plain(placed_count)[__popc(all_plain & before)] = seen_from_plane<flat>(plane, read_vpl(mine));
  if (is_placed) {
    const bool one = (all_one >> lane & 1u) != 0;
    const int at = one ? __popc(all_one & before) : one_count + __popc(all_placed & ~all_one & before);
    room.placed()[at] = placed_on_map<flat>(plane, read_vpl(mine), own.look, Size > 0 ? Size : maps.size);
  }
  __syncwarp();
  add_plain<flat>(in_plane, room.plain(placed_count), plain_count, sums);
  add_placed<flat, true>(in_plane, room.placed(), one_count, sums);
  add_placed<flat, false>(in_plane, room.placed() + one_count, placed_count - one_count, sums);
  const unsigned looking = __ballot_sync(kAllLanes, texels != 0 && !is_plain && !is_placed);
  for (unsigned left = looking; left != 0; left &= left - 1) {
    const LitVpl other = read_vpl(lights + room.waiting[__ffs(static_cast<int>(left)) - 1]);
    const float min_distance_sq = min_distance * min_distance;
#pragma unroll
    for (int k = 0; k < kEach; ++k) {
      const LitPixel& pixel = pixels[k];
      const Arriving a = arriving<flat>(pixel, other, min_distance_sq);
      if (!(a.factor > 0)) continue;
      float share = 1;
      if (other.slot != kNone) {
        const Vec3 local{dot(a.travel, other.x), dot(a.travel, other.y), a.cos_light};
        const Vec3 normal{dot(pixel.ng, other.x), dot(pixel.ng, other.y), dot(pixel.ng, other.z)};
        share = look_up_facing<Depth, Size>(map_of(other), local, normal, a.distance_sq, a.along, maps.size,
                                            codes_of<Depth, Size>(maps, other.slot));
      }
      add_share(other, a, share, min_distance_sq, sums[k]);
    }
  }
}

/// Adds the lights from `first` to before `last`. Those that may arrive wait until there is one for every lane.
template <class Depth, int Size, bool flat>
__device__ void add_block(const LitPixel (&pixels)[kEach], const PlanePixel (&in_plane)[kEach], const WarpPlane& plane,
                          const LitVpl* lights, std::uint32_t first, std::uint32_t last, const MapSetView& maps,
                          float min_distance, WarpRoom& room, PixelSum (&sums)[kEach]) {
  const std::uint32_t lane = threadIdx.x % 32;
  std::uint32_t count = 0;
  for (std::uint32_t begin = first; begin < last; begin += kTileLights) {
    const bool may = begin + lane < last && may_arrive(plane, flat, lights + begin + lane);
    const unsigned all = __ballot_sync(kAllLanes, may);
    if (may) room.waiting[count + static_cast<std::uint32_t>(__popc(all & ((1u << lane) - 1u)))] = begin + lane;
    count += static_cast<std::uint32_t>(__popc(all));
    __syncwarp();
    const bool ends = begin + kTileLights >= last;
    while (count >= kTileLights || (ends && count > 0)) {
      const std::uint32_t here = min_of(kTileLights, count);
      add_lights<Depth, Size, flat>(pixels, in_plane, plane, lights, here, maps, min_distance, room, sums);
      count -= here;
      __syncwarp();
      const std::uint32_t next = lane < count ? room.waiting[kTileLights + lane] : 0;
      __syncwarp();
      if (lane < count) room.waiting[lane] = next;
      __syncwarp();
    }
  }
}

/// A picture's tiles; a block has kEach of them, one below the other.
struct TileRows {
  std::uint32_t across, count;  ///< tiles in a row, and in all
  [[nodiscard]] LC_FN std::uint32_t rows() const { return count / across; }
  [[nodiscard]] LC_FN std::uint32_t blocks() const { return (rows() + kEach - 1) / kEach * across; }
};

/// What a block has of shared memory.
struct BlockRoom {
  uint4 plane_words[(sizeof(WarpPlane) + sizeof(uint4) - 1) / sizeof(uint4)];
  PixelSet<kEach> here;                             ///< the pixels whose turn it is
  bool last;                                        ///< and no others come after them
  float4 sums[kLaunchBlocks][kEach * kTilePixels];  ///< of each block of lights; last: what the clamp took
  WarpRoom warps[kWarps];
  __device__ WarpPlane& plane() { return *reinterpret_cast<WarpPlane*>(plane_words); }
};

/// Adds a pixel's sums to its total.
__device__ void add_sums(const BlockRoom& room, std::uint32_t blocks, std::uint32_t slot, std::uint32_t pixel,
                         const SumView& out) {
  Vec3T<double> light = out.light[slot];
  double lost = out.lost[slot];
  for (std::uint32_t block = 0; block < blocks; ++block) {
    const float4 sum = room.sums[block][pixel];
    light += Vec3T<double>{sum.x, sum.y, sum.z};
    lost += sum.w;
  }
  out.light[slot] = light;
  out.lost[slot] = lost;
}

template <class Depth, int Size>
__global__ void __launch_bounds__(kThreads, 5)
    sum_vpls_kernel(PixelView view, TileRows tiles, const LitVpl* __restrict__ lights, std::uint32_t count,
                    MapSetView maps, float min_distance, SumView out) {
  __shared__ uint4 words[(sizeof(BlockRoom) + sizeof(uint4) - 1) / sizeof(uint4)];
  BlockRoom& room = *reinterpret_cast<BlockRoom*>(words);
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const std::uint32_t first_row = blockIdx.x / tiles.across * kEach, column = blockIdx.x % tiles.across;
  const auto slot_of = [&](std::uint32_t k) { return ((first_row + k) * tiles.across + column) * kTilePixels + lane; };
  // Read again where they are needed again: registers are scarce in between.
  const auto read_pixel = [&](std::uint32_t k) {
    if (first_row + k >= tiles.rows()) return LitPixel{};
    const std::uint32_t slot = slot_of(k);
    return LitPixel{view.position[slot], -view.ns[slot], -view.ng[slot]};
  };
  PixelSet<kEach> left;
  bool flat = true, few = false;
  {
    Vec3 position[kEach], ng[kEach];
#pragma unroll
    for (std::uint32_t k = 0; k < kEach; ++k) {
      const LitPixel pixel = read_pixel(k);
      flat = flat && pixel.ns == pixel.ng;
      left.lanes[k] = __ballot_sync(kAllLanes, !(pixel.ns == Vec3{}));
      position[k] = pixel.position, ng[k] = pixel.ng;
    }
    flat = __all_sync(kAllLanes, flat) != 0;
    if (left.empty()) return;
    if (warp == 0) few = in_few_planes<kEach>(left, position, ng);
  }
  for (bool last = false; !last;) {
    LitPixel pixels[kEach];
#pragma unroll
    for (std::uint32_t k = 0; k < kEach; ++k) pixels[k] = read_pixel(k);
    if (warp == 0) {
      Vec3 position[kEach], ng[kEach];
#pragma unroll
      for (int k = 0; k < kEach; ++k) position[k] = pixels[k].position, ng[k] = pixels[k].ng;
      const PixelSet<kEach> here = few ? in_first_plane<kEach>(left, position, ng) : left;
      left.remove(here);
      const WarpPlane plane = plane_of(flat_receivers<kEach>(here.lanes, position, ng), min_distance);
      if (lane == 0) {
        room.here = here;
        room.last = left.empty();
        room.plane() = plane;
      }
    }
    __syncthreads();
    last = room.last;
    PlanePixel in_plane_of[kEach];
#pragma unroll
    for (int k = 0; k < kEach; ++k) {
      if (room.here.has(k, lane)) {
        in_plane_of[k] = in_plane(room.plane(), pixels[k]);
      } else {
        pixels[k] = {pixels[k].position, {}, {}};  // gets light too, which is not kept
      }
    }
    const std::uint32_t blocks = (count + kSumBlockLights - 1) / kSumBlockLights;
    for (std::uint32_t block = warp; block < blocks; block += kWarps) {
      const std::uint32_t begin = block * kSumBlockLights, end = min_of(begin + kSumBlockLights, count);
      PixelSum sums[kEach];
      if (flat) {
        add_block<Depth, Size, true>(pixels, in_plane_of, room.plane(), lights, begin, end, maps, min_distance,
                                     room.warps[warp], sums);
      } else {
        add_block<Depth, Size, false>(pixels, in_plane_of, room.plane(), lights, begin, end, maps, min_distance,
                                      room.warps[warp], sums);
      }
#pragma unroll
      for (int k = 0; k < kEach; ++k) {
        room.sums[block][k * static_cast<int>(kTilePixels) + static_cast<int>(lane)] = {
            sums[k].light.x, sums[k].light.y, sums[k].light.z, sums[k].lost};
      }
    }
    __syncthreads();
    // In the order of the lights, whichever warps added them.
    static_assert(kEach <= kWarps);
    if (warp < kEach && room.here.has(static_cast<int>(warp), lane)) {
      add_sums(room, blocks, slot_of(warp), warp * kTilePixels + lane, out);
    }
    __syncthreads();
  }
}

// --- Other lights: one thread a pixel ---

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
    if ((i + 1 - first) % kSumBlockLights == 0) sums.close_block(out, slot, true);
  }
  sums.close_block(out, slot, true);
}

using SumVpls = void (*)(PixelView, TileRows, const LitVpl*, std::uint32_t, MapSetView, float, SumView);

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
  const auto step = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
      kLaunchPairs / slots / kSumBlockLights * kSumBlockLights, kSumBlockLights, kLaunchLights));
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
    const TileRows tiles{grid.tiles_across, grid.tile_count};
    kernel_for(maps)<<<tiles.blocks(), kThreads, 0, device.stream()>>>(pixels, tiles, packed.data(), count, maps,
                                                                       min_distance, sums);
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
