#pragma once

#include "kernels/map_lookup.h"

namespace lightcuts {

// One look at a shadow map for many receivers that lie side by side in a plane: pixels of a tile are nearer to each other
// than texels are wide, so most of them ask the same texels and get the same answer. What is said here is what
// look_up_map says of each receiver; where that cannot be said for all of them at once, nothing is.

/// Receivers in a plane: middle + s half_a + t half_b, with s and t from -1 to 1.
struct FlatReceivers {
  Vec3 middle;          ///< [m]
  Vec3 half_a, half_b;  ///< [m]
  Vec3 ng;              ///< unit normal of the plane
  float reach;          ///< |half_a| + |half_b| [m]; infinite where the receivers lie in no plane
  float off = 0;        ///< at most, of a receiver from the plane [m]
};

/// How far receivers may lie off their plane, as a share of their reach, and of their distance from a light that is looked at.
inline constexpr float kFlatness = 2e-3f, kFlatnessSeen = 1e-4f;

/// A plane seen at a smaller cosine is told by each receiver for itself: lookups take such cosines for kLeastFacing.
inline constexpr float kLeastFacingOfGroup = 1.3f * kLeastFacing;

/// Not all receivers get the same, or it is not known that they do: each has to look for itself.
inline constexpr float kEachItsOwn = -1;

namespace detail {

/// The texels that receivers ask along one axis of the map.
struct TexelSpan {
  float lo, hi;            ///< all of them
  float near_lo, near_hi;  ///< those that are some receiver's own
};
LC_KERNEL TexelSpan texel_span(float at, float reach, int size) {
  const float half = 0.5f * static_cast<float>(size), place = at * half + (half - 0.5f);
  const float slack = reach * half + 1e-3f;  // rounding: a thousandth of a texel
  const float least = place - slack, most = place + slack;
  return {std::floor(least), std::floor(most) + 1, std::floor(least + 0.5f), std::floor(most + 0.5f)};
}

/// Bit i: texel lo + i is some receiver's own.
LC_KERNEL std::uint32_t own_texels(const TexelSpan& span) {
  return (2u << static_cast<std::uint32_t>(span.near_hi - span.lo)) -
         (1u << static_cast<std::uint32_t>(span.near_lo - span.lo));
}

}  // namespace detail

/// What look_up_map says of a VPL's map for each of the receivers, 0 for those that lie behind the light; kEachItsOwn where
/// that differs between them, or where they are too far apart to say.
///
/// They get the same where all texels that any of them asks say the same. These are asked with the bias of a receiver's own
/// texel: those beside it have a larger one only where it passes, and then they pass all the more.
///
/// With E = (distance of the middle / distance of the tap's place on the receivers' plane), a tap passes where
/// (code + bias) max(E, distance of the middle / own distance) >= distance of the middle; E is the receiver's own only in so
/// far as the plane's slope was taken at its place on the map. The rest is the room that it has:
/// d E = |second derivative <= 4| * |tap - own place| * |own place - middle's| / facing.
template <class Depth, int Size = 0>
LC_KERNEL float look_up_group(const MapRecord& map, const FlatReceivers& receivers, int size, const Depth* codes) {
  using detail::larger;
  const int side = Size > 0 ? Size : size;
  const float texel = 2.0f / static_cast<float>(side);
  const Vec3 local = to_map(map, receivers.middle);
  const float a_z = dot(receivers.half_a, map.z), b_z = dot(receivers.half_b, map.z);
  const float height = std::fabs(a_z) + std::fabs(b_z);
  const float inverse = detail::quick_inverse_root(larger(dot(local, local), 1e-30f));
  const float share = receivers.reach * inverse;
  const float off = receivers.off * inverse;
  if (!(share < 0.2f && off < kFlatnessSeen)) return kEachItsOwn;
  if (local.z + 1.01f * height < 0) return 0;
  if (!(local.z - 1.01f * height > 0)) return kEachItsOwn;

  // Where the receivers lie on the map: by the derivative, and what the derivative changes (as in paraboloid_box).
  const Vec3 normal{dot(receivers.ng, map.x), dot(receivers.ng, map.y), dot(receivers.ng, map.z)};
  const detail::TapTest<float> test = detail::paraboloid_taps(map, local, normal, side);
  const float depth = -test.minus_depth;
  const float distance = depth * (1 / map.steps), scale = detail::quick_reciprocal(distance + local.z);
  const float u = local.x * scale, v = local.y * scale;
  const float a_x = dot(receivers.half_a, map.x), a_y = dot(receivers.half_a, map.y);
  const float b_x = dot(receivers.half_b, map.x), b_y = dot(receivers.half_b, map.y);
  const float away_a = (a_x * local.x + a_y * local.y + a_z * local.z) * inverse;
  const float away_b = (b_x * local.x + b_y * local.y + b_z * local.z) * inverse;
  const float angle = share * (1 + 1.4f * share), bend = 1.25f * angle * angle;
  const float reach_u = (std::fabs(a_x - u * (away_a + a_z)) + std::fabs(b_x - u * (away_b + b_z))) * scale + bend;
  const float reach_v = (std::fabs(a_y - v * (away_a + a_z)) + std::fabs(b_y - v * (away_b + b_z))) * scale + bend;
  const detail::TexelSpan xs = detail::texel_span(u, reach_u, side), ys = detail::texel_span(v, reach_v, side);
  const float last = static_cast<float>(side - 3);
  if (!(xs.lo >= 0 && xs.lo <= last && ys.lo >= 0 && ys.lo <= last && xs.hi - xs.lo <= 2 && ys.hi - ys.lo <= 2)) {
    return kEachItsOwn;
  }

  // How far the receivers' comparisons differ from the middle's.
  const float facing = std::fabs(dot(local, normal)) * inverse;
  if (facing < kLeastFacingOfGroup) return kEachItsOwn;
  const float wander = reach_u + reach_v;
  const float room = (4.2f * (1.2f * texel + wander) * wander + 2 * off + 1e-5f) * detail::quick_reciprocal(facing);
  const float away = std::fabs(away_a) + std::fabs(away_b);
  const float nearer = away * inverse + share * share;  // at most, as a share
  const float least = 1 - nearer, most = 1 + 1.4f * nearer;
  const float other_bias = (away + height + 2 * receivers.reach * share) * map.bias_steps + 0.51f;
  const float high_depth = depth * (1 + 1e-5f), low_depth = depth * (1 - 1e-5f);

  const auto wide = static_cast<std::int32_t>(xs.hi - xs.lo), tall = static_cast<std::int32_t>(ys.hi - ys.lo);
  const std::uint32_t own_x = detail::own_texels(xs), own_y = detail::own_texels(ys);
  const Depth* const first = codes + static_cast<std::int32_t>(ys.lo) * side + static_cast<std::int32_t>(xs.lo);
  const float change = test.change + (xs.lo - (test.x - detail::kWholeMagic)) * test.change_x +
                       (ys.lo - (test.y - detail::kWholeMagic)) * test.change_y;
  bool all_pass = true, all_fail = true;
#if defined(__CUDA_ARCH__)
#pragma unroll
#endif
  for (int j = 0; j < 3; ++j) {
#if defined(__CUDA_ARCH__)
#pragma unroll
#endif
    for (int i = 0; i < 3; ++i) {
      if (i > wide || j > tall || ((own_x >> i | own_y >> j) & 1u) == 0) continue;
      const auto code = static_cast<float>(first[j * side + i]) + test.bias;
      const float e = change + static_cast<float>(i) * test.change_x + static_cast<float>(j) * test.change_y;
      all_pass = all_pass && (code - other_bias) * larger(e - room, least) >= high_depth;
      all_fail = all_fail && (code + other_bias) * larger(e + room, most) < low_depth;
    }
  }
  return all_pass ? 1 : all_fail ? 0 : kEachItsOwn;
}

}  // namespace lightcuts
