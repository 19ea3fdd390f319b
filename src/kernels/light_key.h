#pragma once

#include <cstdint>

#include "lightcuts/math.h"

namespace lightcuts {

/// Bits of a light's 63-bit sorting key: three coordinates of its position in turn, the highest bits first, and from
/// level `direction_level` on the three coordinates of its axis in between.
struct LightKeyLayout {
  int position_bits = 16;   ///< a coordinate
  int direction_bits = 5;   ///< a coordinate
  int direction_level = 0;  ///< how many bits of each position coordinate stand above the first bits of the axis

  bool operator==(const LightKeyLayout&) const = default;
};

namespace detail {

/// Cell of a coordinate in [0, 1] among 2^bits.
LC_FN std::uint32_t key_cell(float unit, int bits) {
  // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): it invents a negative number of bits.
  const auto cells = static_cast<float>(1u << bits);
  return static_cast<std::uint32_t>(min_of(max_of(unit * cells, 0.0f), cells - 1));
}

/// The bits of one level, x above y above z.
LC_FN std::uint64_t key_digit(std::uint32_t x, std::uint32_t y, std::uint32_t z, int bit) {
  // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): it cannot see that no level is below zero.
  return ((x >> bit & 1u) << 2) | ((y >> bit & 1u) << 1) | (z >> bit & 1u);
}

}  // namespace detail

/// Morton code of a light's position and axis: lights whose codes are near are near in both.
///
/// @param position        [m], inside `bounds`
/// @param axis            unit, or any constant for lights without one
/// @param bounds          of all positions; coordinates are scaled by its longest side alone, so that cells are cubes
LC_FN std::uint64_t light_key(Vec3 position, Vec3 axis, Box bounds, LightKeyLayout layout) {
  const Vec3 extent = bounds.hi - bounds.lo;
  const float longest = max_component(extent);
  const float scale = longest > 0 ? 1 / longest : 0.0f;
  const Vec3 p = (position - bounds.lo) * scale;
  const std::uint32_t px = detail::key_cell(p.x, layout.position_bits),
                      py = detail::key_cell(p.y, layout.position_bits),
                      pz = detail::key_cell(p.z, layout.position_bits);
  const std::uint32_t nx = detail::key_cell(0.5f + 0.5f * axis.x, layout.direction_bits),
                      ny = detail::key_cell(0.5f + 0.5f * axis.y, layout.direction_bits),
                      nz = detail::key_cell(0.5f + 0.5f * axis.z, layout.direction_bits);
  std::uint64_t key = 0;
  for (int level = 0; level < layout.position_bits || level < layout.direction_level + layout.direction_bits; ++level) {
    const int axis_bit = layout.direction_bits - 1 - (level - layout.direction_level);
    if (level >= layout.direction_level && axis_bit >= 0) key = key << 3 | detail::key_digit(nx, ny, nz, axis_bit);
    const int position_bit = layout.position_bits - 1 - level;
    if (position_bit >= 0) key = key << 3 | detail::key_digit(px, py, pz, position_bit);
  }
  return key;
}

}  // namespace lightcuts
