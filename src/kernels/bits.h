#pragma once

#include <bit>
#include <cstdint>

#include "lightcuts/math.h"

namespace lightcuts {

// Bit tricks under one name for CPU and GPU.

LC_FN int count_bits(std::uint32_t v) {
#if defined(__CUDA_ARCH__)
  return __popc(v);
#else
  return std::popcount(v);
#endif
}

/// Index of the highest set bit; v must not be 0.
LC_FN int highest_bit(std::uint32_t v) {
#if defined(__CUDA_ARCH__)
  return 31 - __clz(static_cast<int>(v));
#else
  return 31 - std::countl_zero(v);
#endif
}

/// Index of the lowest set bit; v must not be 0.
LC_FN int lowest_bit(std::uint32_t v) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(v)) - 1;
#else
  return std::countr_zero(v);
#endif
}

LC_FN std::uint32_t bits_of(float v) {
#if defined(__CUDA_ARCH__)
  return __float_as_uint(v);
#else
  return std::bit_cast<std::uint32_t>(v);
#endif
}

LC_FN float float_of(std::uint32_t v) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(v);
#else
  return std::bit_cast<float>(v);
#endif
}

// Of signed numbers, as one operation where a GPU has it. Floats that are not negative are in the order of their bits, and
// the bits of a negative one are a negative number.

/// Largest of three and 0.
LC_FN std::int32_t max3_or_zero(std::int32_t a, std::int32_t b, std::int32_t c) {
#if defined(__CUDA_ARCH__)
  return __vimax3_s32_relu(a, b, c);
#else
  const std::int32_t ab = a < b ? b : a, abc = ab < c ? c : ab;
  return abc < 0 ? 0 : abc;
#endif
}

/// Smallest of four.
LC_FN std::int32_t min4(std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
#if defined(__CUDA_ARCH__)
  return min(__vimin3_s32(a, b, c), d);
#else
  const std::int32_t ab = b < a ? b : a, cd = d < c ? d : c;
  return cd < ab ? cd : ab;
#endif
}

/// Byte k of a word, plus kByteFloat: as a float, without a conversion.
/// @param bits  those of kByteFloat, from where the compiler does not see what they are: as a constant it would load them anew
///              for each byte
inline constexpr float kByteFloat = 32768;
LC_FN float byte_float(std::uint32_t word, int k, std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(__byte_perm(word, bits, 0x7504u | static_cast<std::uint32_t>(k) << 4));
#else
  return float_of(bits | (word >> 8 * k & 0xffu) << 8);
#endif
}

/// `bits` moved up by one, with the sign of v as the lowest one.
LC_FN std::uint32_t push_sign(std::uint32_t bits, float v) {
#if defined(__CUDA_ARCH__)
  return __funnelshift_l(__float_as_uint(v), bits, 1);
#else
  return bits << 1 | bits_of(v) >> 31;
#endif
}

}  // namespace lightcuts
