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

}  // namespace lightcuts
