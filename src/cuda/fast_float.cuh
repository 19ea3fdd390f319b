#pragma once

#include <cmath>

#include "lightcuts/math.h"

namespace lightcuts::cuda {

/// The number type of inner loops on the GPU: divisions and roots by its approximations, which are right to two units in
/// the last place. Bounds have room for that (kBoundFactor), and pictures change by less than from the order of sums.
struct FastFloat {
  float value;

  FastFloat() = default;
  LC_FN explicit FastFloat(float v) : value(v) {}
};

LC_FN FastFloat operator+(FastFloat a, FastFloat b) { return FastFloat(a.value + b.value); }
LC_FN FastFloat operator-(FastFloat a, FastFloat b) { return FastFloat(a.value - b.value); }
LC_FN FastFloat operator*(FastFloat a, FastFloat b) { return FastFloat(a.value * b.value); }
LC_FN FastFloat operator-(FastFloat a) { return FastFloat(-a.value); }
LC_FN bool operator<(FastFloat a, FastFloat b) { return a.value < b.value; }
LC_FN bool operator>(FastFloat a, FastFloat b) { return a.value > b.value; }
LC_FN bool operator>=(FastFloat a, FastFloat b) { return a.value >= b.value; }

LC_KERNEL FastFloat operator/(FastFloat a, FastFloat b) {
#if defined(__CUDA_ARCH__)
  return FastFloat(__fdividef(a.value, b.value));
#else
  return FastFloat(a.value / b.value);
#endif
}
/// For v of at least 1e-37: one instruction, where a quotient that minds denormals takes five.
LC_KERNEL FastFloat reciprocal(FastFloat v) {
#if defined(__CUDA_ARCH__)
  float inverse;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(inverse) : "f"(v.value));
  return FastFloat(inverse);
#else
  return FastFloat(1 / v.value);
#endif
}
/// For v of at least 1e-37.
LC_KERNEL FastFloat inverse_sqrt(FastFloat v) {
#if defined(__CUDA_ARCH__)
  float root;
  asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(root) : "f"(v.value));
  return FastFloat(root);
#else
  return FastFloat(1 / std::sqrt(v.value));
#endif
}
LC_KERNEL FastFloat sqrt(FastFloat v) {
#if defined(__CUDA_ARCH__)
  float root;
  asm("sqrt.approx.ftz.f32 %0, %1;" : "=f"(root) : "f"(v.value));
  return FastFloat(root);
#else
  return FastFloat(std::sqrt(v.value));
#endif
}
LC_KERNEL FastFloat square_root(FastFloat v) { return sqrt(v); }

LC_KERNEL FastFloat min(FastFloat a, FastFloat b) { return FastFloat(fminf(a.value, b.value)); }
LC_KERNEL FastFloat max(FastFloat a, FastFloat b) { return FastFloat(fmaxf(a.value, b.value)); }
LC_KERNEL FastFloat abs(FastFloat a) { return FastFloat(fabsf(a.value)); }
LC_FN FastFloat select(bool condition, FastFloat a, FastFloat b) { return condition ? a : b; }

LC_FN Vec3T<FastFloat> fast(Vec3 v) { return {FastFloat(v.x), FastFloat(v.y), FastFloat(v.z)}; }

}  // namespace lightcuts::cuda
