#pragma once

// Only for files that are compiled once for each instruction set; see lanes.h.
#include "cpu/simd/lanes.h"

namespace lightcuts::LC_ISA {

/// The number type of bounds: divisions and roots by the processor's estimates and one Newton step, right to a few units
/// in the last place, which the bounds' own slack of 1e-5 covers, and many times as fast as exact ones.
struct BoundLanes {
  Batch value;

  BoundLanes() = default;
  LC_LANES_FN explicit BoundLanes(float v) : value(v) {}
  LC_LANES_FN BoundLanes(Batch v) : value(v) {}
};
struct BoundMask {
  BatchBool value;
};

LC_LANES_FN BoundLanes operator+(BoundLanes a, BoundLanes b) { return a.value + b.value; }
LC_LANES_FN BoundLanes operator-(BoundLanes a, BoundLanes b) { return a.value - b.value; }
LC_LANES_FN BoundLanes operator*(BoundLanes a, BoundLanes b) { return a.value * b.value; }
LC_LANES_FN BoundLanes operator-(BoundLanes a) { return -a.value; }
LC_LANES_FN BoundMask operator>(BoundLanes a, BoundLanes b) { return {a.value > b.value}; }
LC_LANES_FN BoundMask operator>=(BoundLanes a, BoundLanes b) { return {a.value >= b.value}; }
LC_LANES_FN BoundLanes min(BoundLanes a, BoundLanes b) { return xsimd::min(a.value, b.value); }
LC_LANES_FN BoundLanes max(BoundLanes a, BoundLanes b) { return xsimd::max(a.value, b.value); }
LC_LANES_FN BoundLanes abs(BoundLanes a) { return xsimd::abs(a.value); }
LC_LANES_FN BoundLanes select(BoundMask m, BoundLanes yes, BoundLanes no) {
  return xsimd::select(m.value, yes.value, no.value);
}

/// a / b for b that are neither 0 nor infinite nor so large that 1 / b is denormal.
LC_LANES_FN BoundLanes operator/(BoundLanes a, BoundLanes b) { return a.value * reciprocal(Lanes(b.value)).value; }

/// 1 / sqrt(v) for v from 1e-37 on, below which the estimate would be infinite.
LC_LANES_FN BoundLanes inverse_sqrt(BoundLanes v) {
#if defined(__SSE2__)
#if defined(__AVX512F__)
  const Batch r = _mm512_rsqrt14_ps(v.value);
#elif defined(__AVX__)
  const Batch r = _mm256_rsqrt_ps(v.value);
#else
  const Batch r = _mm_rsqrt_ps(v.value);
#endif
  return r * (Batch(1.5f) - Batch(0.5f) * v.value * r * r);
#else
  return Batch(1.0f) / xsimd::sqrt(v.value);
#endif
}

/// Square root of a number that is not negative.
LC_LANES_FN BoundLanes sqrt(BoundLanes v) {
#if defined(__SSE2__)
  return v * inverse_sqrt(BoundLanes(xsimd::max(v.value, Batch(1e-37f))));
#else
  return xsimd::sqrt(v.value);
#endif
}

/// The lanes whose bit is set.
LC_LANES_FN BatchBool lanes_of(std::uint32_t bits) {
#if defined(__AVX512F__)
  return BatchBool(static_cast<__mmask16>(bits));
#elif defined(__AVX2__)
  const __m256i one_each = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i set = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), one_each);
  return BatchBool(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, one_each)));
#elif defined(__SSE2__)
  const __m128i one_each = _mm_setr_epi32(1, 2, 4, 8);
  const __m128i set = _mm_and_si128(_mm_set1_epi32(static_cast<int>(bits)), one_each);
  return BatchBool(_mm_castsi128_ps(_mm_cmpeq_epi32(set, one_each)));
#else
  alignas(64) float ones[Lanes::kCount];
  for (int i = 0; i < Lanes::kCount; ++i) ones[i] = static_cast<float>(bits >> i & 1u);
  return Batch::load_aligned(ones) > Batch(0.5f);
#endif
}

}  // namespace lightcuts::LC_ISA
