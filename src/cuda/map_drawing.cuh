#pragma once

#include <cstdint>

#include "cuda/shadow_maps.h"
#include "cuda/warp.cuh"
#include "kernels/draw_map.h"

// Drawing points of surfaces into a map, by a block of threads. Discs differ much in how many texels they may cover, and
// in how many edges cut them; lanes that draw one each would wait for the largest. So a block first projects points, a lane
// each, and sorts those that the map sees by what their discs cost; then each warp draws discs of one kind.

namespace lightcuts::cuda {

inline constexpr int kWarp = 32;

struct DrawParams {
  PointsView points;
  const MapRecord* records;
  const std::uint32_t* streams;
  void* codes;             ///< of the first map
  std::uint32_t* scratch;  ///< a part for each block, or null: shared memory serves
  std::uint32_t count;
  std::uint32_t scratch_words;  ///< a block's part
  std::uint32_t codes_at;       ///< where the map begins in shared memory [bytes]
  int size, size_bits, levels;
  bool keeps_surfaces_apart;
  bool noise;
  double share;  ///< of all points that noise chooses
};

// --- Points ---

/// A point as it is stored.
struct ReadPoint {
  Vec3 position, normal;
  float sink, radius;
  std::uint32_t cuts;
};
__device__ inline ReadPoint read_point(const PointsView& points, std::uint32_t index) {
  const float4* const words = reinterpret_cast<const float4*>(points.points + index);
  const float4 a = __ldg(words), b = __ldg(words + 1);
  return {{a.x, a.y, a.z}, {b.x, b.y, b.z}, b.w, __ldg(points.radii + index), __float_as_uint(a.w)};
}

/// map_sees without branches: z > -r where z |z| > -r^2.
template <bool Paraboloid>
__device__ inline bool sees(const MapView& view, Vec3 local, float largest) {
  if constexpr (!Paraboloid) return local.z > 0;
  const bool beyond_rim = view.rim_sq > 1;
  const float cosine_sq = beyond_rim ? 0.0f : kLeastCosine * kLeastCosine;
  const float slack = beyond_rim ? -largest * largest : 0.0f;
  return local.z * fabsf(local.z) > cosine_sq * dot(local, local) + slack;
}

// Which copy of a piece of code draws a disc depends on the discs beside it in the queue, whose order is one of atomics. So a
// texel must be the same to the last bit in all copies, while a compiler is free to fuse a product with a sum in one and not
// in another. Hence all that a texel of a paraboloid is drawn with is computed by operations that say whether they are fused.

__device__ inline float fused_dot(Vec3 a, Vec3 b) {
  return __fmaf_rn(a.z, b.z, __fmaf_rn(a.y, b.y, __fmul_rn(a.x, b.x)));
}
/// a s + b
__device__ inline Vec3 fused(Vec3 a, float s, Vec3 b) {
  return {__fmaf_rn(a.x, s, b.x), __fmaf_rn(a.y, s, b.y), __fmaf_rn(a.z, s, b.z)};
}
__device__ inline Vec3 to_view(const MapView& view, Vec3 v) {
  return {fused_dot(v, view.frame.x), fused_dot(v, view.frame.y), fused_dot(v, view.frame.z)};
}

/// A point's disc in the view's coordinates: the first step of project_disc.
struct LocalDisc {
  Vec3 centre, normal;
  float plane;
};
__device__ inline LocalDisc local_disc(const MapView& view, Vec3 local, Vec3 world_normal, float sink) {
  LocalDisc disc;
  disc.normal = to_view(view, world_normal);
  disc.plane = fused_dot(local, disc.normal);
  const float deeper = disc.plane < 0 ? sink_in_front(sink) : sink_behind(sink);
  disc.centre = fused(disc.normal, deeper, local);
  disc.plane += deeper;
  return disc;
}

/// As map_disc of shadow_map.h.
__device__ inline MapDisc<float> map_disc(const LocalDisc& disc, float radius) {
  const float inverse = reciprocal(disc.plane);
  return {{__fmul_rn(disc.normal.x, inverse), __fmul_rn(disc.normal.y, inverse), __fmul_rn(disc.normal.z, inverse)},
          disc.centre + disc.centre,
          __fmaf_rn(-radius, radius, fused_dot(disc.centre, disc.centre))};
}
/// As map_edge, of an edge in world space.
__device__ inline Vec3 map_edge(const MapView& view, const MapDisc<float>& disc, float4 edge) {
  const Vec3 inward{edge.x, edge.y, edge.z};
  return fused(disc.normal, fused_dot(inward, view.origin) - edge.w, to_view(view, inward));
}

// --- What discs may cover ---

struct TexelBox {
  std::uint32_t x, y, columns, rows;
};

/// a b + c within [0, 1].
__device__ inline float saturated(float a, float b, float c) {
  float r;
  asm("fma.rn.ftz.sat.f32 %0, %1, %2, %3;" : "=f"(r) : "f"(a), "f"(b), "f"(c));
  return r;
}

/// Texels whose centres lie within `half` of `at`, in [-1, 1] coordinates: the first, and how many.
/// A sum with 2^23 rounded down is that of the whole part.
__device__ inline void texels_within(float at, float half, float side, float middle, std::uint32_t& first,
                                     std::uint32_t& count) {
  const float place = 0.5f * at + middle;
  const float lo = __fmaf_rd(saturated(half, -0.5f, place), side, 0x1p23f);
  const float hi = __fmaf_rd(saturated(half, 0.5f, place), side, 0x1p23f);
  first = __float_as_uint(lo) & 0x7fffffu;
  count = __float_as_uint(hi) - __float_as_uint(lo);
}

/// What a disc of a paraboloid map may cover, without branches. It may differ from project_disc's by rounding: both hold the disc.
__device__ inline TexelBox paraboloid_texels(const LocalDisc& disc, float radius, float side) {
  const Vec3 local = disc.centre, normal = disc.normal;
  const float distance_sq = dot(local, local), radius_sq = radius * radius, tangent_sq = distance_sq - radius_sq;
  const float inverse = detail::quick_inverse_root(fmaxf(distance_sq, 1e-30f)), distance = distance_sq * inverse;
  const float far_sq = local.z > 0 ? distance_sq * (kSmallDisc * kSmallDisc) : 0.0f;
  const bool near = far_sq <= radius_sq;  // as paraboloid_footprint, else as paraboloid_box
  const bool whole = tangent_sq < 0;
  const float root = near ? square_root(fmaxf(tangent_sq, 0.0f)) : distance;
  const float scale = whole ? 0.0f : detail::quick_reciprocal(fmaxf(root + local.z, 1e-30f));
  const float u = local.x * scale, v = local.y * scale, along = disc.plane * inverse + normal.z;
  const float across_u = normal.x - u * along, across_v = normal.y - v * along;
  const float share = radius * inverse, angle = share * (1 + 1 / (1 - kSmallDisc) * share);
  const float bend = 1.25f * angle * angle, reach = radius * scale, footprint = whole ? 4.0f : reach;
  const float half_u = near ? footprint : reach * square_root(saturated(-across_u, across_u, 1)) + bend;
  const float half_v = near ? footprint : reach * square_root(saturated(-across_v, across_v, 1)) + bend;
  const float middle = 0.5f + 0.5f / side;
  TexelBox box;
  texels_within(u, half_u, side, middle, box.x, box.columns);
  texels_within(v, half_v, side, middle, box.y, box.rows);
  if (!(disc.plane * disc.plane > kLeastPlane * kLeastPlane * distance_sq)) box.rows = 0;
  return box;
}

__device__ inline TexelBox orthographic_texels(const MapView& view, const LocalDisc& disc, float radius, int size) {
  const Footprint<float> print = orthographic_footprint(disc.centre, radius, view.half_width);
  const float half = 0.5f * static_cast<float>(size);
  const TexelRange columns = texel_range((print.u + 1) * half, print.radius * half, size);
  const TexelRange rows = texel_range((print.v + 1) * half, print.radius * half, size);
  const auto count = [](TexelRange range) { return static_cast<std::uint32_t>(max(0, range.hi - range.lo + 1)); };
  return {static_cast<std::uint32_t>(columns.lo), static_cast<std::uint32_t>(rows.lo), count(columns), count(rows)};
}

// --- The queue ---

/// Discs are drawn two by two texels, a quad, at a time. Those of up to 4 quads are drawn by one lane each, those of up to 32
/// by kLanesOfMany, larger ones by a warp.
inline constexpr int kLanesOfMany = 4;
inline constexpr std::uint32_t kBins = 32, kFirstOfMany = 1, kFirstOfFew = 16;

/// Where a disc stands among those of the queue: largest kind first, then those with edges, then by quads and edges.
__device__ inline std::uint32_t bin_of(std::uint32_t quads, std::uint32_t edges) {
  const auto doublings = static_cast<std::uint32_t>(32 - __clz(static_cast<int>(quads - 1)));  // 0 of one quad
  const bool few = doublings < 3;
  const std::uint32_t within = few ? doublings : doublings - 3, last = few ? 2 * kFirstOfFew - 2 : kFirstOfFew - 1;
  return doublings > 5 ? 0 : last - (edges > 0 ? 2 + 4 * within + edges : within);
}

/// Points a round: a disc's bin and its number there take 16 bits, less one value.
inline constexpr std::uint32_t kRoom = 2046;
inline constexpr std::uint32_t kNoDisc = 0xffff;

/// A round of points, some of which have a disc that waits. Only its box is kept: to project a disc again costs less than
/// to hold it, for then fewer blocks would work at once.
template <class Box>
struct alignas(16) DiscQueue {
  Box boxes[kRoom];             ///< by point of the round
  std::uint16_t places[kRoom];  ///< a disc's number in its bin and the bin, or kNoDisc
  std::uint16_t order[kRoom];
  std::uint32_t bins[kBins];  ///< how many discs; then where they begin in the order
  std::uint32_t count;
};

/// Columns and rows of quads from (x, y) on, in a map of 2^bits texels a side.
template <class Box>
__device__ inline Box pack_box(std::uint32_t x, std::uint32_t y, std::uint32_t columns, std::uint32_t rows, int bits) {
  return Box{x} | Box{y} << bits | Box{columns - 1} << 2 * bits | Box{rows - 1} << (3 * bits - 1);
}

/// Puts a point's disc into the queue, if the map sees any of it.
template <bool Paraboloid, class Box>
__device__ inline void queue_point(const PointsView& points, const MapView& view, int size, int bits,
                                   std::uint32_t index, bool chosen, std::uint32_t at, DiscQueue<Box>& queue) {
  const ReadPoint point = read_point(points, index);
  const Vec3 local = to_view(view, point.position - view.origin);
  const LocalDisc disc = local_disc(view, local, point.normal, point.sink);
  const TexelBox box = Paraboloid ? paraboloid_texels(disc, point.radius, static_cast<float>(size))
                                  : orthographic_texels(view, disc, point.radius, size);
  std::uint32_t place = kNoDisc;
  if (chosen && sees<Paraboloid>(view, local, points.largest) && box.columns > 0 && box.rows > 0) {
    const std::uint32_t columns = (box.columns + 1) / 2, rows = (box.rows + 1) / 2;
    const std::uint32_t bin = bin_of(columns * rows, static_cast<std::uint32_t>(__popc(near_edges(point.cuts))));
    place = atomicAdd(&queue.bins[bin], 1u) << 5 | bin;
    const auto side = static_cast<std::uint32_t>(size);  // quads stay within the map
    queue.boxes[at] = pack_box<Box>(min(box.x, side - 2 * columns), min(box.y, side - 2 * rows), columns, rows, bits);
  }
  queue.places[at] = static_cast<std::uint16_t>(place);
}

/// Brings the discs of a round of so many points into their order.
template <class Box>
__device__ inline void order_queue(DiscQueue<Box>& queue, std::uint32_t points, int threads) {
  __syncthreads();
  if (threadIdx.x < kBins) {
    const std::uint32_t own = queue.bins[threadIdx.x];
    std::uint32_t end = own;
    for (std::uint32_t step = 1; step < kBins; step *= 2) {
      const std::uint32_t other = __shfl_up_sync(kAllLanes, end, step);
      if (threadIdx.x >= step) end += other;
    }
    queue.bins[threadIdx.x] = end - own;
    if (threadIdx.x == kBins - 1) queue.count = end;
  }
  __syncthreads();
  for (std::uint32_t i = threadIdx.x; i < points; i += static_cast<std::uint32_t>(threads)) {
    const std::uint32_t place = queue.places[i];
    if (place != kNoDisc) queue.order[queue.bins[place & 31u] + (place >> 5)] = static_cast<std::uint16_t>(i);
  }
  __syncthreads();
}

// --- Texels ---

/// Small whole numbers as floats and back, without the conversions, which GPUs do at a quarter of their speed.
__device__ inline float float_of_small(std::uint32_t i) { return __uint_as_float(0x4b000000u | i) - 0x1p23f; }
__device__ inline int small_of_float(float whole) {
  return static_cast<int>(__float_as_uint(whole + 0x1p23f) & 0x7fffffu);
}
/// Also of numbers a little below 0, where steps would be halves beside 2^23.
__device__ inline float round_small(float v) { return (v + 0x1.8p23f) - 0x1.8p23f; }

// What a texel is drawn with: larger is nearer, 0 or below is none. Of floats above 0 the bits are in order.
inline constexpr int kFarthest = 0x7fffffff;

/// Texels in shared memory, drawn where `outside` is not above 0. All lanes ask for the maximum, of nothing where they have
/// nothing to draw: a branch takes longer.
struct SharedTexels {
  std::uint32_t address;
  __device__ explicit SharedTexels(int* texels)
      : address(static_cast<std::uint32_t>(__cvta_generic_to_shared(texels))) {}
  __device__ void draw(int texel, int nearness, float outside) const {
    asm volatile("red.shared.max.s32 [%0], %1;" ::"r"(address + 4 * static_cast<std::uint32_t>(texel)),
                 "r"(outside <= 0 ? nearness : 0)
                 : "memory");
  }
};
struct GlobalTexels {
  int* texels;
  __device__ explicit GlobalTexels(int* t) : texels(t) {}
  __device__ void draw(int texel, int nearness, float outside) const {
    if (outside <= 0) atomicMax(texels + texel, nearness);
  }
};

/// A form a u + b v + c (1 - u^2 - v^2), as rays of texels are measured along a direction: the parts of a column and of a
/// row, which are added.
struct RayForm {
  float a, b, c;
  __device__ explicit RayForm(Vec3 direction) : a(2 * direction.x), b(2 * direction.y), c(direction.z) {}
  __device__ float of_column(float u, float u_sq) const { return __fmaf_rn(a, u, __fmul_rn(-c, u_sq)); }
  __device__ float of_row(float v, float v_sq) const { return __fmaf_rn(b, v, __fmaf_rn(-c, v_sq, c)); }
};

/// Draws the texels at (u, v), one to the right and one below; `Edges` of `edges` may cut the disc.
template <int Edges, class Texels>
__device__ inline void draw_quad(const MapDisc<float>& disc, const Vec3 (&edges)[kDiscEdges], float u, float v,
                                 float texel, int size, int at, const Texels& texels) {
  const float us[2] = {u, u + texel}, vs[2] = {v, v + texel};
  const float u_sq[2] = {__fmul_rn(us[0], us[0]), __fmul_rn(us[1], us[1])};
  const float v_sq[2] = {__fmul_rn(vs[0], vs[0]), __fmul_rn(vs[1], vs[1])};
  const RayForm normal(disc.normal), centre(disc.twice_centre);
  float outside[2][2], nearness[2][2];
#pragma unroll
  for (int j = 0; j < 2; ++j) {
#pragma unroll
    for (int i = 0; i < 2; ++i) {
      const float s = normal.of_column(us[i], u_sq[i]) + normal.of_row(vs[j], v_sq[j]);
      const float c = centre.of_column(us[i], u_sq[i]) + centre.of_row(vs[j], v_sq[j]);
      const float length = (1 + u_sq[i]) + v_sq[j];
      nearness[j][i] = s;
      outside[j][i] = __fmaf_rn(s, __fmaf_rn(disc.slack, s, -c), __fmul_rn(length, length));
    }
  }
#pragma unroll
  for (int e = 0; e < Edges; ++e) {
    const RayForm edge(edges[e]);
#pragma unroll
    for (int j = 0; j < 2; ++j) {
#pragma unroll
      for (int i = 0; i < 2; ++i) {
        // An edge that is none is 0.
        const float inward = edge.of_column(us[i], u_sq[i]) + edge.of_row(vs[j], v_sq[j]);
        outside[j][i] = fmaxf(outside[j][i], -inward);
      }
    }
  }
#pragma unroll
  for (int j = 0; j < 2; ++j) {
#pragma unroll
    for (int i = 0; i < 2; ++i) texels.draw(at + j * size + i, __float_as_int(nearness[j][i]), outside[j][i]);
  }
}

/// The same of an orthographic map, a texel at a time.
template <class Texels>
__device__ inline void draw_orthographic_quad(const PointsView& points, const MapView& view, const LocalDisc& disc,
                                              float radius, std::uint32_t cuts, float u, float v, float texel, int size,
                                              int at, const Texels& texels) {
  for (int i = 0; i < 4; ++i) {
    const Vec3 hit =
        meet_plane_orthographic(u + static_cast<float>(i % 2) * texel, v + static_cast<float>(i / 2) * texel,
                                disc.normal, disc.plane, view.half_width);
    bool inside = hit.z > 0 && length_sq(hit - disc.centre) < radius * radius;
    for (std::uint32_t left = near_edges(cuts); left != 0; left &= left - 1) {
      const DiscEdge edge =
          points.edges[first_edge(cuts) + static_cast<std::uint32_t>(__ffs(static_cast<int>(left))) - 1];
      inside =
          inside && dot(to_local_vector(view.frame, edge.inward), hit) > edge.offset - dot(edge.inward, view.origin);
    }
    texels.draw(at + i / 2 * size + i % 2, kFarthest - __float_as_int(hit.z), inside ? -1.0f : 1.0f);
  }
}

// --- Drawing what is queued ---

/// The largest of the lanes' numbers, from 0 to 4.
__device__ inline int most_of_warp(int v) {
#if __CUDA_ARCH__ >= 800
  return static_cast<int>(__reduce_max_sync(kAllLanes, static_cast<std::uint32_t>(v)));
#else
  for (int n = 4; n > 0; --n) {
    if (__any_sync(kAllLanes, v >= n) != 0) return n;
  }
  return 0;
#endif
}

/// The quads of a disc's box.
struct Quads {
  float x, y, columns, count;
};
template <class Box>
__device__ inline Quads quads_of(Box box, int bits) {
  const auto field = [&](int from, int width) {
    return float_of_small(static_cast<std::uint32_t>(box >> from) & ((1u << width) - 1u));
  };
  Quads quads{field(0, bits), field(bits, bits), field(2 * bits, bits - 1) + 1, 0};
  quads.count = quads.columns * (field(3 * bits - 1, bits - 1) + 1);
  return quads;
}

/// Calls draw(u, v, texel) for every `step`-th quad, from number `first` on.
template <class Draw>
__device__ inline void for_quads(const Quads& quads, float first, float step, int size, const Draw& draw) {
  const auto side = static_cast<float>(size);
  const float texel = 2.0f / side, middle = 0.5f * texel - 1;
  const float inverse_columns = 1 / quads.columns;
  for (float number = first; number < quads.count; number += step) {
    const float row = round_small((number + 0.5f) * inverse_columns - 0.5f);
    const float x = quads.x + 2 * (number - row * quads.columns), y = quads.y + 2 * row;
    draw(__fmaf_rn(x, texel, middle), __fmaf_rn(y, texel, middle), small_of_float(y * side + x));
  }
}

template <int Edges, class Texels>
__device__ inline void draw_disc(const MapDisc<float>& disc, const Quads& quads, const Vec3 (&edges)[kDiscEdges],
                                 float first, float step, int size, const Texels& texels) {
  const float texel = 2.0f / static_cast<float>(size);
  for_quads(quads, first, step, size,
            [&](float u, float v, int at) { draw_quad<Edges>(disc, edges, u, v, texel, size, at, texels); });
}

/// Draws a paraboloid map's discs, each lane a part of one; lanes without a disc have one of no quads.
template <class Texels>
__device__ inline void draw_cut_disc(const PointsView& points, const MapView& view, const MapDisc<float>& disc,
                                     const Quads& quads, std::uint32_t cuts, float first, float step, int size,
                                     const Texels& texels) {
  Vec3 edges[kDiscEdges] = {};
  std::uint32_t left = near_edges(cuts);
  const int most = most_of_warp(__popc(left));
#pragma unroll
  for (int e = 0; e < kDiscEdges; ++e) {
    if (e >= most) break;
    float4 edge{0, 0, 0, 0};  // none
    if (left != 0) {
      const std::uint32_t which = first_edge(cuts) + static_cast<std::uint32_t>(__ffs(static_cast<int>(left))) - 1;
      edge = __ldg(reinterpret_cast<const float4*>(points.edges) + which);
    }
    left &= left - 1;
    edges[e] = map_edge(view, disc, edge);
  }
  if (most == 0) {
    draw_disc<0>(disc, quads, edges, first, step, size, texels);
  } else if (most == 1) {
    draw_disc<1>(disc, quads, edges, first, step, size, texels);
  } else if (most == 2) {
    draw_disc<2>(disc, quads, edges, first, step, size, texels);
  } else {
    draw_disc<kDiscEdges>(disc, quads, edges, first, step, size, texels);
  }
}

/// Draws the discs of a queue in their order; `first_point` is the round's first.
template <bool Paraboloid, class Box, class Texels>
__device__ inline void draw_queue(const PointsView& points, const MapView& view, int size, int bits, int threads,
                                  std::uint32_t first_point, const DiscQueue<Box>& queue, const Texels& texels) {
  const std::uint32_t lane = threadIdx.x % kWarp, all = queue.count;
  const std::uint32_t many = queue.bins[kFirstOfMany], few = queue.bins[kFirstOfFew];
  constexpr std::uint32_t kManyAtOnce = kWarp / kLanesOfMany;
  const std::uint32_t begin_few = many + (few - many + kManyAtOnce - 1) / kManyAtOnce;
  const std::uint32_t units = begin_few + (all - few + kWarp - 1) / kWarp;
  for (std::uint32_t unit = threadIdx.x / kWarp; unit < units; unit += static_cast<std::uint32_t>(threads / kWarp)) {
    std::uint32_t at, end, lanes;  // of the order; that share a disc
    if (unit < many) {
      at = unit;
      end = many;
      lanes = kWarp;
    } else if (unit < begin_few) {
      at = many + (unit - many) * kManyAtOnce + lane / kLanesOfMany;
      end = few;
      lanes = kLanesOfMany;
    } else {
      at = few + (unit - begin_few) * kWarp + lane;
      end = all;
      lanes = 1;
    }
    const std::uint32_t queued = queue.order[min(at, end - 1)];
    std::uint32_t index = first_point + queued;
    if (index >= points.count) index -= points.count;
    const ReadPoint point = read_point(points, index);
    Quads quads = quads_of(queue.boxes[queued], bits);
    if (at >= end) quads.count = 0;
    const LocalDisc disc = local_disc(view, to_view(view, point.position - view.origin), point.normal, point.sink);
    const float first = float_of_small(lane & (lanes - 1)), step = float_of_small(lanes);
    if constexpr (Paraboloid) {
      draw_cut_disc(points, view, map_disc(disc, point.radius), quads, point.cuts, first, step, size, texels);
    } else {
      const float texel = 2.0f / static_cast<float>(size);
      for_quads(quads, first, step, size, [&](float u, float v, int to) {
        draw_orthographic_quad(points, view, disc, point.radius, point.cuts, u, v, texel, size, to, texels);
      });
    }
  }
}

/// Draws a map's points, a round at a time.
template <bool Paraboloid, bool Noise, class Box, class Texels>
__device__ inline void draw_chosen_points(const DrawParams& p, const MapView& view, int size, int bits, int threads,
                                          std::uint32_t stream, DiscQueue<Box>& queue, const Texels& texels) {
  const std::uint32_t all = p.points.count, tried = Noise ? all : min(p.points.per_map, all);
  std::uint32_t first = Noise ? 0 : block_start(stream, all);
  for (std::uint32_t done = 0; done < tried; done += kRoom) {
    if (threadIdx.x < kBins) queue.bins[threadIdx.x] = 0;
    __syncthreads();
    const std::uint32_t count = min(kRoom, tried - done);
    for (std::uint32_t k = threadIdx.x; k < count; k += static_cast<std::uint32_t>(threads)) {
      std::uint32_t i = first + k;
      if (i >= all) i -= all;
      const bool chosen = !Noise || noise_chooses(i, stream, p.share);
      queue_point<Paraboloid>(p.points, view, size, bits, i, chosen, k, queue);
    }
    order_queue(queue, count, threads);
    draw_queue<Paraboloid>(p.points, view, size, bits, threads, first, queue, texels);
    __syncthreads();
    first += count;
    if (first >= all) first -= all;
  }
}

template <bool Paraboloid, class Box, class Texels>
__device__ inline void draw_all_points(const DrawParams& p, const MapView& view, int size, int bits, int threads,
                                       std::uint32_t stream, DiscQueue<Box>& queue, const Texels& texels) {
  if (p.noise) {
    draw_chosen_points<Paraboloid, true>(p, view, size, bits, threads, stream, queue, texels);
  } else {
    draw_chosen_points<Paraboloid, false>(p, view, size, bits, threads, stream, queue, texels);
  }
}

/// The depth code of a texel.
template <bool Paraboloid, class Depth>
__device__ inline Depth code_of(const MapView& view, float steps, int nearness, float u, float v) {
  if (nearness <= 0) return kNoDepth<Depth>;
  if constexpr (!Paraboloid) return encode_depth<Depth>(__int_as_float(kFarthest - nearness), steps);
  const float rho_sq = u * u + v * v;
  if (!(rho_sq < view.rim_sq)) return kNoDepth<Depth>;
  return encode_depth<Depth>(depth_of_nearness(__int_as_float(nearness), 1 + rho_sq), steps);
}

/// Turns what was drawn into depth codes, in place.
template <bool Paraboloid, class Depth>
__device__ inline void encode_map(const MapView& view, float steps, int size, int bits, int threads,
                                  std::uint32_t* codes) {
  const int texels = size * size;
  for (int i = static_cast<int>(threadIdx.x); i < texels; i += threads) {
    codes[i] = code_of<Paraboloid, Depth>(view, steps, static_cast<int>(codes[i]), texel_centre(i & (size - 1), size),
                                          texel_centre(i >> bits, size));
  }
}

}  // namespace lightcuts::cuda
