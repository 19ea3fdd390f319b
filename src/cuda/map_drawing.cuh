#pragma once

#include <cstdint>

#include "cuda/shadow_maps.h"
#include "kernels/draw_map.h"

// Drawing points of surfaces into a map: a warp projects a disc a lane, then shares out the texels of all of them.

namespace lightcuts::cuda {

inline constexpr int kWarp = 32;
inline constexpr std::uint32_t kAllLanes = 0xffffffffu;

struct DrawParams {
  PointsView points;
  const MapRecord* records;
  const std::uint32_t* streams;
  void* codes;             ///< of the first map
  std::uint32_t* scratch;  ///< a part for each block, or null: shared memory serves
  std::uint32_t count;
  std::uint32_t scratch_words;  ///< a block's part
  int size, size_bits, levels;
  bool keeps_surfaces_apart;
  bool noise;
};

/// Texels of a row that a lane draws one after the other.
inline constexpr int kRun = 4;

/// What a disc may cover, cut into runs of up to kRun texels; numbers as floats, which are quicker than conversions.
struct alignas(16) RunBox {
  float lo_x, lo_y, end_x;
  float runs;  ///< in a row
  float inverse_runs;
  int begin;  ///< where the disc's runs begin among those of all
  int edge_count;
  float radius_sq;  ///< orthographic
};

/// Discs that a warp found in its points, side by side, so that its lanes can share out the runs of all of them.
struct alignas(16) WarpDiscs {
  float4 first[kWarp];   ///< of MapDisc the normal and the slack (orthographic: unit normal, plane)
  float4 second[kWarp];  ///< twice the centre (orthographic: once)
  RunBox box[kWarp];
  float4 edges[kWarp][5];  ///< those that come near; a fifth entry against bank conflicts
};

/// The lanes' numbers in a row: for each lane the last of the ascending `starts` that is not above its number.
__device__ inline int owner_of(int first, int start, int lane) {
  const bool within = start >= first && start < first + kWarp;
  const std::uint32_t own = within ? 1u << (start - first) : 0u;
#if __CUDA_ARCH__ >= 800
  const std::uint32_t marks = __reduce_or_sync(kAllLanes, own);
#else
  std::uint32_t marks = own;
  for (int step = 16; step > 0; step /= 2) marks |= __shfl_xor_sync(kAllLanes, marks, step);
#endif
  const int before = __popc(__ballot_sync(kAllLanes, start < first));
  return before + __popc(marks & (2u << lane) - 1u) - 1;
}

/// Runs that a disc's box is cut into.
__device__ inline int runs_of(const ProjectedDisc& disc) {
  return disc.empty() ? 0 : (disc.width() + kRun - 1) / kRun * (disc.rows.hi - disc.rows.lo + 1);
}

template <bool Paraboloid>
__device__ inline void stage_disc(const ProjectedDisc& disc, float radius_sq, int at, int begin, WarpDiscs& discs) {
  const Vec3 n = Paraboloid ? disc.disc.normal : disc.normal, c = Paraboloid ? disc.disc.twice_centre : disc.local;
  const auto runs = static_cast<float>((disc.width() + kRun - 1) / kRun);
  discs.first[at] = {n.x, n.y, n.z, Paraboloid ? disc.disc.slack : disc.plane};
  discs.second[at] = {c.x, c.y, c.z, 0};
  discs.box[at] = {static_cast<float>(disc.columns.lo),
                   static_cast<float>(disc.rows.lo),
                   static_cast<float>(disc.columns.hi + 1),
                   runs,
                   1 / runs,
                   begin,
                   0,
                   radius_sq};
}

/// Stages the edges of a cut disc that come near it.
template <bool Paraboloid>
__device__ inline void stage_edges(const MapView& view, const ProjectedDisc& disc, const DiscShape& shape, Vec3 centre,
                                   int at, WarpDiscs& discs) {
  int count = 0;
  for (int i = 0; i < kDiscEdges; ++i) {
    const Vec3 world = shape.inward[i];
    if (dot(world, centre) - shape.offset[i] >= shape.radius) continue;
    const float offset = shape.offset[i] - dot(world, view.origin);
    Vec3 inward = to_local_vector(view.frame, world);
    if (Paraboloid) inward = map_edge(disc.disc, inward, offset);
    discs.edges[at][count++] = {inward.x, inward.y, inward.z, offset};
  }
  discs.box[at].edge_count = count;
}

/// Small whole numbers as floats and back, without the conversions, which GPUs do at a quarter of their speed.
__device__ inline float float_of_small(int i) {
  return __uint_as_float(0x4b000000u | static_cast<std::uint32_t>(i)) - 0x1p23f;
}
__device__ inline int small_of_float(float whole) {
  return static_cast<int>(__float_as_uint(whole + 0x1p23f) & 0x7fffffu);
}
/// Also of numbers a little below 0, where steps would be halves beside 2^23.
__device__ inline float round_small(float v) { return (v + 0x1.8p23f) - 0x1.8p23f; }

/// What a texel that a disc covers is drawn with: larger is nearer, 0 is none. Of floats above 0 the bits are in order.
template <bool Paraboloid>
__device__ inline std::uint32_t nearness_at(const MapView& view, float4 first, float4 second, const float4* edges,
                                            int edge_count, float radius_sq, float u, float v) {
  if constexpr (Paraboloid) {
    const MapDisc<float> disc{{first.x, first.y, first.z}, {second.x, second.y, second.z}, first.w};
    const TexelRay<float> w = texel_ray(u, u * u, v, v * v);
    const DiscTest<float> test = test_disc(disc, w);
    if (!(test.nearness > 0) || !(test.outside < 0)) return 0;
    for (int e = 0; e < edge_count; ++e) {
      if (!(along(w, Vec3{edges[e].x, edges[e].y, edges[e].z}) > 0)) return 0;
    }
    return __float_as_uint(test.nearness);
  } else {
    const Vec3 hit = meet_plane_orthographic(u, v, Vec3{first.x, first.y, first.z}, first.w, view.half_width);
    if (!(hit.z > 0) || !(length_sq(hit - Vec3{second.x, second.y, second.z}) < radius_sq)) return 0;
    for (int e = 0; e < edge_count; ++e) {
      if (!(dot(Vec3{edges[e].x, edges[e].y, edges[e].z}, hit) > edges[e].w)) return 0;
    }
    return ~__float_as_uint(hit.z);
  }
}

/// Draws run `number` of all that the warp's discs may cover; disc `owner` has it.
template <bool Paraboloid>
__device__ inline void draw_run(const MapView& view, const WarpDiscs& discs, int owner, int number, float side,
                                float texel, std::uint32_t* nearness) {
  const RunBox box = discs.box[owner];
  const float inside = float_of_small(number - box.begin) + 0.5f;
  const float row = round_small(inside * box.inverse_runs - 0.5f);
  const float y = box.lo_y + row, x = box.lo_x + kRun * (inside - 0.5f - row * box.runs);
  const float v = y * texel + (0.5f * texel - 1);
  const float4 first = discs.first[owner], second = discs.second[owner];
  std::uint32_t* const at = nearness + small_of_float(y * side + x);
#pragma unroll
  for (int k = 0; k < kRun; ++k) {
    const float column = x + static_cast<float>(k);
    if (column >= box.end_x) break;
    const std::uint32_t found = nearness_at<Paraboloid>(view, first, second, discs.edges[owner], box.edge_count,
                                                        box.radius_sq, column * texel + (0.5f * texel - 1), v);
    if (found > at[k]) atomicMax(at + k, found);
  }
}

/// The depth code of a texel.
template <bool Paraboloid, class Depth>
__device__ inline Depth code_of(const MapView& view, float steps, std::uint32_t nearness, float u, float v) {
  if (nearness == 0) return kNoDepth<Depth>;
  if constexpr (!Paraboloid) return encode_depth<Depth>(__uint_as_float(~nearness), steps);
  const float rho_sq = u * u + v * v;
  if (!(rho_sq < view.rim_sq)) return kNoDepth<Depth>;
  return encode_depth<Depth>(depth_of_nearness(__uint_as_float(nearness), 1 + rho_sq), steps);
}

/// Draws the points of a warp's lanes, `index` kNone: none.
template <bool Paraboloid>
__device__ inline void draw_points(const DrawParams& p, const MapView& view, int size, std::uint32_t index, int lane,
                                   WarpDiscs& discs, std::uint32_t* nearness) {
  ProjectedDisc disc;
  Vec3 centre;
  int runs = 0;
  float radius = p.points.largest;
  std::uint32_t shape = 0;
  if (index != kNone) {
    const float4* const words = reinterpret_cast<const float4*>(p.points.points + index);
    const float4 a = __ldg(words);
    centre = {a.x, a.y, a.z};
    const Vec3 local = to_local_point(view, centre);
    if (map_sees<Paraboloid>(view, local, p.points.largest)) {
      const float4 b = __ldg(words + 1);
      shape = __float_as_uint(a.w);
      if (shape != 0) radius = __ldg(&p.points.shapes[shape].radius);
      disc = project_disc<Paraboloid>(view, local, Vec3{b.x, b.y, b.z}, radius, b.w, size);
      runs = runs_of(disc);
    }
  }
  int end = runs;
  for (int step = 1; step < kWarp; step *= 2) {
    const int other = __shfl_up_sync(kAllLanes, end, step);
    if (lane >= step) end += other;
  }
  const int total = __shfl_sync(kAllLanes, end, kWarp - 1);
  if (total == 0) return;
  const std::uint32_t has = __ballot_sync(kAllLanes, runs > 0);
  __syncwarp();
  if (runs > 0) {
    const int at = __popc(has & ((1u << lane) - 1u));
    stage_disc<Paraboloid>(disc, radius * radius, at, end - runs, discs);
    if (shape > 1) stage_edges<Paraboloid>(view, disc, p.points.shapes[shape], centre, at, discs);
  }
  __syncwarp();
  const int start = lane < __popc(has) ? discs.box[lane].begin : 0x7fffffff;
  const auto side = static_cast<float>(size);
  const float texel = 2.0f / side;
  for (int first = 0; first < total; first += kWarp) {
    const int owner = owner_of(first, start, lane);
    if (first + lane >= total) continue;
    draw_run<Paraboloid>(view, discs, owner, first + lane, side, texel, nearness);
  }
}

template <bool Paraboloid>
__device__ inline void draw_all_points(const DrawParams& p, const MapView& view, int size, std::uint32_t threads,
                                       std::uint32_t stream, WarpDiscs& discs, std::uint32_t* nearness) {
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const std::uint32_t first = threadIdx.x - static_cast<std::uint32_t>(lane);
  const std::uint32_t all = p.points.count, wanted = min(p.points.per_map, all);
  if (p.noise) {
    const double share = static_cast<double>(wanted) / static_cast<double>(all);
    for (std::uint32_t base = first; base < all; base += threads) {
      const std::uint32_t i = base + static_cast<std::uint32_t>(lane);
      const bool chosen = i < all && noise_chooses(i, stream, share);
      if (__ballot_sync(kAllLanes, chosen) == 0) continue;
      draw_points<Paraboloid>(p, view, size, chosen ? i : kNone, lane, discs, nearness);
    }
    return;
  }
  const std::uint32_t start = block_start(stream, all);
  for (std::uint32_t base = first; base < wanted; base += threads) {
    const std::uint32_t k = base + static_cast<std::uint32_t>(lane);
    std::uint32_t i = start + k;
    if (i >= all) i -= all;
    draw_points<Paraboloid>(p, view, size, k < wanted ? i : kNone, lane, discs, nearness);
  }
}

/// Turns what was drawn into depth codes, in place.
template <bool Paraboloid, class Depth>
__device__ inline void encode_map(const MapView& view, float steps, int size, int bits, int threads,
                                  std::uint32_t* codes) {
  const int texels = size * size;
  for (int i = static_cast<int>(threadIdx.x); i < texels; i += threads) {
    codes[i] = code_of<Paraboloid, Depth>(view, steps, codes[i], texel_centre(i & (size - 1), size),
                                          texel_centre(i >> bits, size));
  }
}

}  // namespace lightcuts::cuda
