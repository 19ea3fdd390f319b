#pragma once

#include "cuda/pixels.h"
#include "cuda/warp.cuh"
#include "kernels/group_lookup.h"

namespace lightcuts::cuda {

/// The unit vector along v within the plane, or any other in it where v has hardly a part there.
__device__ inline Vec3 within_plane(Vec3 v, Vec3 ng) {
  const Vec3 part = v - ng * dot(ng, v);
  const float size_sq = dot(part, part);
  if (size_sq > 1e-4f * dot(v, v)) return part * rsqrtf(size_sq);
  const Vec3 other = fabsf(ng.x) < 0.6f ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  return normalize(cross(ng, other));
}

/// The parallelogram that holds the pixels of `Each` tiles, one below the other, that lie in one plane, along the tiles' rows and
/// columns.
///
/// @param lanes  whose pixels count, of each tile; not none; all lanes must take part and get the same
template <int Each>
__device__ inline FlatReceivers flat_receivers(const unsigned (&lanes)[Each], const Vec3 (&position)[Each],
                                               const Vec3 (&ng)[Each]) {
  static_assert(kTileWidth == 8 && kTileHeight == 4);
  const int lane = static_cast<int>(threadIdx.x % 32);
  FlatReceivers group;
  bool in[Each];
  Vec3 first;
  int count = 0;
  float columns = 0, rows = 0;
#pragma unroll
  for (int k = Each - 1; k >= 0; --k) {
    in[k] = (lanes[k] >> lane & 1u) != 0;
    if (lanes[k] != 0) {
      const int leader = __ffs(static_cast<int>(lanes[k])) - 1;
      group.ng = from_lane(ng[k], leader);
      first = from_lane(position[k], leader);
    }
    const auto bits = [&](unsigned mask) { return static_cast<float>(__popc(lanes[k] & mask)); };
    count += __popc(lanes[k]);
    columns += bits(0xaaaaaaaau) + 2 * bits(0xccccccccu) + 4 * bits(0xf0f0f0f0u);
    rows += bits(0xff00ff00u) + 2 * bits(0xffff0000u) + static_cast<float>(k * kTileHeight) * bits(~0u);
  }

  // How the position grows with column and row, by regression.
  const float share = 1.0f / static_cast<float>(count);
  bool alike = true;
  Vec3 by_column, by_row;
#pragma unroll
  for (int k = 0; k < Each; ++k) {
    const Vec3 way = position[k] - first, turned = ng[k] - group.ng;
    alike = alike && (!in[k] || dot(turned, turned) < 1e-10f);
    if (in[k]) {
      by_column += way * (static_cast<float>(lane % kTileWidth) - share * columns);
      by_row += way * (static_cast<float>(lane / kTileWidth + k * kTileHeight) - share * rows);
    }
  }
  alike = __all_sync(kAllLanes, alike) != 0;
  const Vec3 a = within_plane(warp_sum(by_column), group.ng);
  Vec3 b = within_plane(warp_sum(by_row), group.ng);
  float area = dot(cross(a, b), group.ng);
  if (!(fabsf(area) > 0.1f)) {
    b = cross(group.ng, a);
    area = 1;
  }

  float off = 0, s_lo = kInfinity, s_hi = -kInfinity, t_lo = kInfinity, t_hi = -kInfinity;
#pragma unroll
  for (int k = 0; k < Each; ++k) {
    const Vec3 way = position[k] - first;
    const float s = dot(cross(way, b), group.ng) / area, t = dot(cross(a, way), group.ng) / area;
    if (in[k]) {
      off = fmaxf(off, fabsf(dot(way, group.ng)));
      s_lo = fminf(s_lo, s), s_hi = fmaxf(s_hi, s);
      t_lo = fminf(t_lo, t), t_hi = fmaxf(t_hi, t);
    }
  }
  off = warp_max(off);
  s_lo = warp_min(s_lo), s_hi = warp_max(s_hi);
  t_lo = warp_min(t_lo), t_hi = warp_max(t_hi);
  group.middle = first + a * (0.5f * (s_lo + s_hi)) + b * (0.5f * (t_lo + t_hi));
  const float half_s = 0.5f * (s_hi - s_lo), half_t = 0.5f * (t_hi - t_lo);
  group.half_a = a * half_s;
  group.half_b = b * half_t;
  // Positions are off their triangle by what rounding may be.
  const float reach = half_s + half_t;
  group.reach = alike && off <= kFlatness * reach + 1e-6f * max_component(max_of(first, -first)) ? reach : kInfinity;
  group.off = off;
  return group;
}

/// The same of one tile.
__device__ inline FlatReceivers flat_receivers(unsigned lanes, Vec3 position, Vec3 ng) {
  return flat_receivers<1>({lanes}, {position}, {ng});
}

}  // namespace lightcuts::cuda
