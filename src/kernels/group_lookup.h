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

// What one look says of the texels that receivers ask, at most three by three: a word. Bit i + 3 j: texel (i, j) lets
// light pass to any receiver whose own it is; nine bits on: to any that asks it beside its own, which lets light pass.
// Above them, in seven bits each, the column and the row of texel (0, 0).
inline constexpr std::uint32_t kGroupTexels = 0x3ffffu;  ///< all of them, and no other bit: all light arrives
inline constexpr std::uint32_t kGroupUnsure = ~0u;       ///< kEachItsOwn
inline constexpr int kMostGroupSize = 128;               ///< of maps whose texels fit a word

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

/// Bit i + 3 j: texel (i, j) is some receiver's own; and: or beside one, not those that only a diagonal leads to.
struct AskedTexels {
  std::uint32_t own, all;
};
LC_KERNEL AskedTexels asked_texels(std::uint32_t own_x, std::uint32_t own_y, std::uint32_t wide, std::uint32_t tall) {
  constexpr std::uint32_t kFirstColumn = 0b001001001;
  const std::uint32_t rows = (own_y & 1u) * 7 | (own_y >> 1 & 1u) * (7 << 3) | (own_y >> 2 & 1u) * (7 << 6);
  const std::uint32_t columns = own_x * kFirstColumn;
  return {columns & rows, (columns | rows) & ((2u << wide) - 1) * kFirstColumn & ((8u << 3 * tall) - 1)};
}

/// Three codes of each of three rows, as BiasedCode takes them before its shift; the last row only where `tall` is 2.
template <class Depth>
LC_KERNEL void nine_codes(const Depth* codes, std::uint32_t column, std::uint32_t row, std::uint32_t side,
                          std::uint32_t tall, float (&out)[9]) {
#if defined(__CUDA_ARCH__)
  if constexpr (sizeof(Depth) == 2) {
    const std::uint32_t* const words = reinterpret_cast<const std::uint32_t*>(codes) + ((row * side + column) >> 1);
    const std::uint32_t shift = (column & 1u) * 16;
#pragma unroll
    for (std::uint32_t j = 0; j < 3; ++j) {
      std::uint32_t lo = 0, hi = 0;
      if (j <= tall) {
        lo = words[j * (side / 2)];
        hi = words[j * (side / 2) + 1];
      }
      const std::uint32_t two = __funnelshift_r(lo, hi, shift), last = hi >> shift;
      out[3 * j] = float_of(__byte_perm(two, kWholeBits, 0x7610));
      out[3 * j + 1] = float_of(__byte_perm(two, kWholeBits, 0x7632));
      out[3 * j + 2] = float_of(__byte_perm(last, kWholeBits, 0x7610));
    }
  } else
#endif
    for (std::uint32_t j = 0; j < 3; ++j) {
      for (std::uint32_t i = 0; i < 3; ++i) {
        const Depth code = j <= tall ? codes[(row + j) * side + column + i] : Depth{0};
        out[3 * j + i] = sizeof(Depth) == 2 ? kWholeMagic + static_cast<float>(code) : static_cast<float>(code);
      }
    }
}

}  // namespace detail

/// What one look at a VPL's map says of all of the receivers.
struct GroupLook {
  /// A word of what they ask, 0 where no light arrives, kGroupTexels where all does, kGroupUnsure where not all texels say the
  /// same to every receiver, or the receivers are too far apart to say.
  std::uint32_t texels;
  std::uint32_t own;  ///< of a word: bit i + 3 j: texel (i, j) is some receiver's own
};

/// Looks at a VPL's map for all of the receivers. Those behind the light get nothing.
///
/// Texels are asked with the bias of a receiver's own, and with that of those beside it, which is larger.
///
/// With E = (distance of the middle / distance of the tap's place on the receivers' plane), a tap passes where
/// (code + bias) max(E, distance of the middle / own distance) >= distance of the middle; E is the receiver's own only in so
/// far as the plane's slope was taken at its place on the map. The rest is the room that it has:
/// d E = |second derivative <= 4| * |tap - own place| * |own place - middle's| / facing.
template <class Depth, int Size = 0>
LC_KERNEL GroupLook look_at_group(const MapRecord& map, const FlatReceivers& receivers, int size, const Depth* codes) {
  using detail::larger;
  const int side = Size > 0 ? Size : size;
  const float texel = 2.0f / static_cast<float>(side);
  const Vec3 local = to_map(map, receivers.middle);
  const float a_z = dot(receivers.half_a, map.z), b_z = dot(receivers.half_b, map.z);
  const float height = std::fabs(a_z) + std::fabs(b_z);
  const float inverse = detail::quick_inverse_root(larger(dot(local, local), 1e-30f));
  const float share = receivers.reach * inverse;
  const float off = receivers.off * inverse;
  if (!(share < 0.2f && off < kFlatnessSeen)) return {kGroupUnsure, 0};
  if (local.z + 1.01f * height < 0) return {0, 0};
  if (!(local.z - 1.01f * height > 0)) return {kGroupUnsure, 0};

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
    return {kGroupUnsure, 0};
  }

  // How far the receivers' comparisons differ from the middle's.
  const float facing = std::fabs(dot(local, normal)) * inverse;
  if (facing < kLeastFacingOfGroup) return {kGroupUnsure, 0};
  const float wander = reach_u + reach_v;
  const float room = (4.2f * (1.2f * texel + wander) * wander + 2 * off + 1e-5f) * detail::quick_reciprocal(facing);
  const float away = std::fabs(away_a) + std::fabs(away_b);
  const float nearer = away * inverse + share * share;  // at most, as a share
  const float least = 1 - nearer, most = 1 + 1.4f * nearer;
  const float other_bias = (away + height + 2 * receivers.reach * share) * map.bias_steps + 0.51f;
  const float high_depth = depth * (1 + 1e-5f), low_depth = depth * (1 - 1e-5f);

  const auto wide = static_cast<std::uint32_t>(xs.hi - xs.lo), tall = static_cast<std::uint32_t>(ys.hi - ys.lo);
  const auto column = static_cast<std::uint32_t>(xs.lo), row = static_cast<std::uint32_t>(ys.lo);
  const detail::AskedTexels asked = detail::asked_texels(detail::own_texels(xs), detail::own_texels(ys), wide, tall);
  const float change = test.change + (xs.lo - (test.x - detail::kWholeMagic)) * test.change_x +
                       (ys.lo - (test.y - detail::kWholeMagic)) * test.change_y;
  float code[9];
  detail::nine_codes<Depth>(codes, column, row, static_cast<std::uint32_t>(side), tall, code);
  const detail::BiasedCode<Depth> own(test.bias), beside(detail::bias_beside(test.bias));
  const float more = beside.shift - own.shift;
  const float other_beside = kBesideBiasTexels / kBiasTexels * (other_bias - 0.51f) + 0.51f;
  // A bit a texel, from signs: that it does not pass, or fails, for certain, as a receiver's own or beside it.
  std::uint32_t not_passing = 0, failing = 0, not_passing_beside = 0, failing_beside = 0;
#if defined(__CUDA_ARCH__)
#pragma unroll
#endif
  for (int k = 8; k >= 0; --k) {
    const float at = code[k] + own.shift;
    const int i = k % 3, j = k / 3;
    const float e = change + static_cast<float>(i) * test.change_x + static_cast<float>(j) * test.change_y;
    const float near = larger(e - room, least), far = larger(e + room, most);
    const float above = at * near - high_depth, below = at * far - low_depth;
    not_passing = push_sign(not_passing, above - other_bias * near);
    failing = push_sign(failing, below + other_bias * far);
    not_passing_beside = push_sign(not_passing_beside, above + (more - other_beside) * near);
    failing_beside = push_sign(failing_beside, below + (more + other_beside) * far);
  }
  if ((not_passing & asked.all) == 0) return {kGroupTexels, 0};
  if ((~failing & asked.all) == 0) return {0, 0};
  const std::uint32_t unsure = (not_passing & ~failing) | (not_passing_beside & ~failing_beside);
  if ((unsure & asked.all) != 0 || side > kMostGroupSize) return {kGroupUnsure, 0};
  return {(~not_passing & 511u) | (~not_passing_beside & 511u) << 9 | column << 18 | row << 25, asked.own};
}

template <class Depth, int Size = 0>
LC_KERNEL std::uint32_t look_up_group_texels(const MapRecord& map, const FlatReceivers& receivers, int size,
                                             const Depth* codes) {
  return look_at_group<Depth, Size>(map, receivers, size, codes).texels;
}

/// What look_up_map says of a VPL's map for each of the receivers, 0 for those that lie behind the light; kEachItsOwn where
/// that differs between them, or where they are too far apart to say. For tests; renderers ask for the texels.
template <class Depth, int Size = 0>
LC_KERNEL float look_up_group(const MapRecord& map, const FlatReceivers& receivers, int size, const Depth* codes) {
  const std::uint32_t texels = look_up_group_texels<Depth, Size>(map, receivers, size, codes);
  return texels == kGroupTexels ? 1 : texels == 0 ? 0 : kEachItsOwn;
}

/// The share of one receiver of a group by its place, which is what look_up_map says, without asking the map.
///
/// @param texels  what the group's look said, neither kGroupUnsure nor kGroupTexels
/// @param x, y    the receiver's place on the map, in texels from the centre of texel (0, 0) of the word
LC_KERNEL float share_by_place(std::uint32_t texels, float x, float y) {
  using detail::kWholeMagic;
  const float index_x = x + kWholeMagic, index_y = y + kWholeMagic;
  const float rest_x = (index_x - kWholeMagic) - x, rest_y = (index_y - kWholeMagic) - y;
  const std::uint32_t own = (bits_of(index_x) - detail::kWholeBits) + 3 * (bits_of(index_y) - detail::kWholeBits);
  const bool passes = (texels >> own & 1u) != 0;
  const std::uint32_t around = (passes ? texels >> 9 : texels) << 3 >> own;  // bit 3: the receiver's own texel
  const float weight_x = std::fabs(rest_x), weight_y = std::fabs(rest_y);
  const float of_x = (around & (rest_x < 0 ? 1u << 4 : 1u << 2)) != 0 ? weight_x : 0.0f;
  const float of_y = (around & (rest_y < 0 ? 1u << 6 : 1u)) != 0 ? weight_y : 0.0f;
  return detail::larger((passes ? 1 - weight_x - weight_y : 0.0f) + (of_x + of_y), 0.0f);
}

/// The same where all receivers have the same texel for their own: at_centre + x_slope x + x_bend |x| + y_slope y + y_bend |y|,
/// x and y being the receiver's place in texels from that one's centre.
struct OneTexelShare {
  float at_centre, x_slope, x_bend, y_slope, y_bend;
};
/// @param own  that texel, i + 3 j
LC_KERNEL OneTexelShare share_of_one_texel(std::uint32_t texels, std::uint32_t own) {
  const bool passes = (texels >> own & 1u) != 0;
  const std::uint32_t others =
      (passes ? ~(texels >> 9) : texels) << 3 >> own;  // that say otherwise than the own, at bit 3
  const float half = passes ? -0.5f : 0.5f;
  const auto side = [&](std::uint32_t bit) { return (others >> bit & 1u) != 0 ? half : 0.0f; };
  const float right = side(4), left = side(2), above = side(6), below = side(0);
  return {passes ? 1.0f : 0.0f, right - left, right + left, above - below, above + below};
}

/// Column and row of texel (0, 0) of a word.
LC_KERNEL std::uint32_t group_column(std::uint32_t texels) { return texels >> 18 & 127u; }
LC_KERNEL std::uint32_t group_row(std::uint32_t texels) { return texels >> 25; }

/// The same of a receiver as to_map sees it, in front of the light.
template <int Size = 0>
LC_KERNEL float share_by_place(std::uint32_t texels, Vec3 local, float distance_sq, int size) {
  const float half = 0.5f * static_cast<float>(Size > 0 ? Size : size);
  const float distance = distance_sq * detail::quick_inverse_root(detail::larger(distance_sq, 1e-30f));
  const float scale = half * detail::quick_reciprocal(distance + local.z);
  return share_by_place(texels, local.x * scale + (half - 0.5f - static_cast<float>(group_column(texels))),
                        local.y * scale + (half - 0.5f - static_cast<float>(group_row(texels))));
}

}  // namespace lightcuts
