#pragma once

#include <cstdint>

#include "lightcuts/math.h"

namespace lightcuts {

/// Puts two zero bits between the 21 bits of v.
LC_FN std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffull;
  v = (v | v << 16) & 0x1f0000ff0000ffull;
  v = (v | v << 8) & 0x100f00f00f00f00full;
  v = (v | v << 4) & 0x10c30c30c30c30c3ull;
  return (v | v << 2) & 0x1249249249249249ull;
}

/// Place of p along the Z curve through `box`, 21 bits an axis. Axes share one scale, so that cells are cubes.
LC_FN std::uint64_t morton_key(const Box& box, Vec3 p) {
  const float extent = max_component(box.hi - box.lo);
  const float scale = extent > 0 ? 2097151.0f / extent : 0.0f;
  const Vec3 q = (p - box.lo) * scale;
  const auto cell = [](float v) { return static_cast<std::uint64_t>(clamp_to(v, 0.0f, 2097151.0f)); };
  return spread_bits(cell(q.x)) << 2 | spread_bits(cell(q.y)) << 1 | spread_bits(cell(q.z));
}

}  // namespace lightcuts
