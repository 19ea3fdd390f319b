#pragma once

#include <cstdint>

#include "lightcuts/math.h"

namespace lightcuts {

/// Largest search window of the locally ordered builder; its offset shares a word with a pair's size.
inline constexpr std::uint32_t kLargestPlocRadius = 31;

// The compiler's own bit cast: the library's is a host function to nvcc.

/// A pair's size with its place in the order of ties in the lowest five bits: a float that orders pairs.
///
/// Both clusters of a pair get the same number, so that there always is a pair that is best for both. Of equal pairs, one
/// at an even position with its successor comes first: identical lights then halve in number at each round.
///
/// @param size    of the merged cluster, >= 0
/// @param lower   array position of the lower cluster of the pair
/// @param offset  how far up the other one is, 1 to kLargestPlocRadius
LC_FN float ploc_rank(float size, std::uint32_t lower, std::uint32_t offset) {
  const bool first = (offset == 1) & ((lower & 1u) == 0);
  const std::uint32_t code = first ? 0u : offset;
  const float finite = min_of(1e38f, size);  // 1e38 for what is not a number, too
  return __builtin_bit_cast(float, (__builtin_bit_cast(std::uint32_t, finite) & ~kLargestPlocRadius) | code);
}

/// How far up (positive) or down (negative) the best partner of the cluster at `position` is.
///
/// @param up    smallest rank among the pairs with a cluster further up; infinity (all bits of a rank's size) if none
/// @param down  the same for pairs further down
LC_FN std::int32_t ploc_offset(float up, float down, std::uint32_t position) {
  const float best = up < down ? up : down;
  const auto code = static_cast<std::int32_t>(__builtin_bit_cast(std::uint32_t, best) & kLargestPlocRadius);
  if (code == 0) return (position & 1u) == 0 ? 1 : -1;
  return up < down ? code : -code;
}

}  // namespace lightcuts
