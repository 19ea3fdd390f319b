#pragma once

// Only for files that are compiled once for each instruction set: LC_ISA names the namespace that keeps their types, and
// with them every template instantiated on them, apart from those of the other sets. Everything here is inlined by
// force, so that no such file leaves a symbol that the linker could take for baseline code.
#ifndef LC_ISA
#error "lanes.h belongs to files compiled for one instruction set; define LC_ISA"
#endif

#include <cstddef>
#include <cstdint>
#include <xsimd/xsimd.hpp>

#define LC_LANES_FN [[gnu::always_inline]] inline

namespace lightcuts::LC_ISA {

using Batch = xsimd::batch<float>;  // of the best set that this file's flags allow
using BatchBool = Batch::batch_bool_type;

/// One bit of decision a lane.
struct Mask {
  BatchBool value;
};

/// A register of floats, one a pixel, that the templates of src/kernels take for their number type.
struct Lanes {
  static constexpr int kCount = static_cast<int>(Batch::size);
  static constexpr std::uint32_t kAllBits = kCount == 32 ? 0xffffffffu : (1u << kCount) - 1u;

  Batch value;

  Lanes() = default;
  LC_LANES_FN explicit Lanes(float v) : value(v) {}
  LC_LANES_FN Lanes(Batch v) : value(v) {}
  LC_LANES_FN static Lanes load(const float* aligned) { return Batch::load_aligned(aligned); }
  LC_LANES_FN void store(float* aligned) const { value.store_aligned(aligned); }
};

LC_LANES_FN Lanes operator+(Lanes a, Lanes b) { return a.value + b.value; }
LC_LANES_FN Lanes operator-(Lanes a, Lanes b) { return a.value - b.value; }
LC_LANES_FN Lanes operator*(Lanes a, Lanes b) { return a.value * b.value; }
LC_LANES_FN Lanes operator/(Lanes a, Lanes b) { return a.value / b.value; }
LC_LANES_FN Lanes operator-(Lanes a) { return -a.value; }
LC_LANES_FN Mask operator<(Lanes a, Lanes b) { return {a.value < b.value}; }
LC_LANES_FN Mask operator>(Lanes a, Lanes b) { return {a.value > b.value}; }
LC_LANES_FN Mask operator&(Mask a, Mask b) { return {a.value & b.value}; }
LC_LANES_FN Mask operator|(Mask a, Mask b) { return {a.value | b.value}; }
LC_LANES_FN Lanes min_of(Lanes a, Lanes b) { return xsimd::min(a.value, b.value); }
LC_LANES_FN Lanes max_of(Lanes a, Lanes b) { return xsimd::max(a.value, b.value); }
LC_LANES_FN Lanes select(Mask m, Lanes yes, Lanes no) { return xsimd::select(m.value, yes.value, no.value); }
LC_LANES_FN Lanes square_root(Lanes v) { return xsimd::sqrt(v.value); }

/// 1 / v to about one unit in the last place: the processor's estimate and one Newton step (two where the estimate is
/// of NEON's 8 bits). Not for 0, infinities and numbers whose reciprocal is denormal.
LC_LANES_FN Lanes reciprocal(Lanes v) {
  Batch r = xsimd::reciprocal(v.value);
#if !defined(__SSE2__)
  r = r * (Batch(2.0f) - v.value * r);
#endif
  return r * (Batch(2.0f) - v.value * r);
}

// For the text of kernels/map_lookup.h.
LC_LANES_FN Lanes larger(Lanes a, Lanes b) { return max_of(a, b); }
LC_LANES_FN Lanes smaller(Lanes a, Lanes b) { return min_of(a, b); }
LC_LANES_FN Lanes quick_reciprocal(Lanes v) { return reciprocal(v); }
/// 1 / sqrt(v): the processor's estimate and one Newton step. (xsimd 8.1 misnames the instruction.)
LC_LANES_FN Lanes quick_inverse_root(Lanes v) {
#if defined(__AVX512F__)
  const Batch r = _mm512_rsqrt14_ps(v.value);
#elif defined(__AVX__)
  const Batch r = _mm256_rsqrt_ps(v.value);
#elif defined(__SSE2__)
  const Batch r = _mm_rsqrt_ps(v.value);
#else
  return Batch(1.0f) / xsimd::sqrt(v.value);
#endif
#if defined(__SSE2__)
  return r * (Batch(1.5f) - Batch(0.5f) * v.value * r * r);
#endif
}

/// The lanes' decisions as bits, lane 0 lowest.
LC_LANES_FN std::uint32_t bits(Mask m) {
#if defined(__AVX512F__)
  return static_cast<std::uint32_t>(static_cast<__mmask16>(m.value));
#elif defined(__AVX__)
  return static_cast<std::uint32_t>(_mm256_movemask_ps(m.value));
#elif defined(__SSE2__)
  return static_cast<std::uint32_t>(_mm_movemask_ps(m.value));
#else
  alignas(64) float ones[Lanes::kCount];
  select(m, Lanes(1.0f), Lanes(0.0f)).store(ones);
  std::uint32_t result = 0;
  for (int i = 0; i < Lanes::kCount; ++i) result |= (ones[i] != 0.0f ? 1u : 0u) << i;
  return result;
#endif
}

}  // namespace lightcuts::LC_ISA
