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

/// The parallelogram that holds the pixels of a tile that lie in one plane, along the tile's rows and columns.
///
/// @param lanes  whose pixels count, not none; all lanes must take part and get the same
__device__ inline FlatReceivers flat_receivers(unsigned lanes, Vec3 position, Vec3 ng) {
  static_assert(kTileWidth == 8 && kTileHeight == 4);
  const int lane = static_cast<int>(threadIdx.x % 32), leader = __ffs(static_cast<int>(lanes)) - 1;
  const bool in = (lanes >> lane & 1u) != 0;
  FlatReceivers group;
  group.ng = from_lane(ng, leader);
  const Vec3 first = from_lane(position, leader), way = position - first, turned = ng - group.ng;
  const bool alike = __all_sync(kAllLanes, !in || dot(turned, turned) < 1e-10f) != 0;

  // How the position grows with column and row, by regression.
  const float share = 1.0f / static_cast<float>(__popc(lanes));
  const auto bits = [&](unsigned mask) { return static_cast<float>(__popc(lanes & mask)); };
  const float column = static_cast<float>(lane % kTileWidth) -
                       share * (bits(0xaaaaaaaau) + 2 * bits(0xccccccccu) + 4 * bits(0xf0f0f0f0u));
  const float row = static_cast<float>(lane / kTileWidth) - share * (bits(0xff00ff00u) + 2 * bits(0xffff0000u));
  const Vec3 a = within_plane(warp_sum(in ? way * column : Vec3{}), group.ng);
  Vec3 b = within_plane(warp_sum(in ? way * row : Vec3{}), group.ng);
  float area = dot(cross(a, b), group.ng);
  if (!(fabsf(area) > 0.1f)) {
    b = cross(group.ng, a);
    area = 1;
  }

  const float s = dot(cross(way, b), group.ng) / area, t = dot(cross(a, way), group.ng) / area;
  const float off = warp_max(in ? fabsf(dot(way, group.ng)) : 0.0f);
  const float s_lo = warp_min(in ? s : kInfinity), s_hi = warp_max(in ? s : -kInfinity);
  const float t_lo = warp_min(in ? t : kInfinity), t_hi = warp_max(in ? t : -kInfinity);
  group.middle = first + a * (0.5f * (s_lo + s_hi)) + b * (0.5f * (t_lo + t_hi));
  const float half_s = 0.5f * (s_hi - s_lo), half_t = 0.5f * (t_hi - t_lo);
  group.half_a = a * half_s;
  group.half_b = b * half_t;
  const float reach = half_s + half_t;
  // Positions are off their triangle by what rounding may be.
  group.reach = alike && off <= kFlatness * reach + 1e-6f * max_component(max_of(first, -first)) ? reach : kInfinity;
  group.off = off;
  return group;
}

}  // namespace lightcuts::cuda
