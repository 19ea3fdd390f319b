#pragma once

#include <cmath>

#include "lightcuts/math.h"

namespace lightcuts {

/// The part of CIE L*a*b* that is not lightness, and the chroma C = sqrt(a^2 + b^2). Kept for each light, so that a
/// difference costs a few operations.
struct Chromaticity {
  float a = 0, b = 0, chroma = 0;
};
LC_FN bool operator==(const Chromaticity& p, const Chromaticity& q) {
  return p.a == q.a && p.b == q.b && p.chroma == q.chroma;
}

/// Largest difference of two colours of the sRGB gamut that are scaled to maximum 1: pure blue and pure green.
inline constexpr float kLargestColourDifference = 87.0f;

namespace detail {

/// The companding of L*a*b*: a cube root with a linear part near black.
template <class T>
LC_FN T lab_compress(T t) {
  using std::cbrt;
  return t > T(216.0 / 24389.0) ? cbrt(t) : (T(24389.0 / 27.0) * t + T(16)) / T(116);
}

}  // namespace detail

/// L*, a*, b* of linear sRGB (Rec. 709, D65), returned in this order. Source: CIE 1976; white is the matrix' row sums.
template <class T>
LC_FN Vec3T<T> lab_from_linear_rgb(Vec3T<T> c) {
  const T x = (T(0.4124564) * c.x + T(0.3575761) * c.y + T(0.1804375) * c.z) / T(0.950470);
  const T y = T(0.2126729) * c.x + T(0.7151522) * c.y + T(0.0721750) * c.z;
  const T z = (T(0.0193339) * c.x + T(0.1191920) * c.y + T(0.9503041) * c.z) / T(1.088830);
  const T fx = detail::lab_compress(x), fy = detail::lab_compress(y), fz = detail::lab_compress(z);
  return {T(116) * fy - T(16), T(500) * (fx - fy), T(200) * (fy - fz)};
}

/// Chromaticity of an intensity, which is first scaled to maximum 1: a, b and C grow with the cube root of intensity, and
/// the metric must not. Black counts as white.
LC_FN Chromaticity chromaticity(Vec3 intensity) {
  const float largest = max_component(intensity);
  if (!(largest > 0)) return {};
  const Vec3 lab = lab_from_linear_rgb(intensity / largest);
  return {lab.y, lab.z, std::sqrt(lab.y * lab.y + lab.z * lab.z)};
}

/// CIE94 (graphic arts) with the reference chroma given, lightness left out:
/// sqrt((dC / (1 + 0.045 C))^2 + (dH / (1 + 0.015 C))^2).
template <class T>
LC_FN T cie94_without_lightness(T a1, T b1, T c1, T a2, T b2, T c2, T reference_chroma) {
  using std::sqrt;
  const T da = a1 - a2, db = b1 - b2, dc = c1 - c2;
  const T dh_sq = max_of(da * da + db * db - dc * dc, T(0));
  const T s_c = T(1) + T(0.045) * reference_chroma, s_h = T(1) + T(0.015) * reference_chroma;
  return sqrt(dc * dc / (s_c * s_c) + dh_sq / (s_h * s_h));
}

/// Difference of two light colours, in [0, 1], symmetric: the chroma's mean serves as reference.
LC_FN float colour_difference(const Chromaticity& p, const Chromaticity& q) {
  const float mean = 0.5f * (p.chroma + q.chroma);
  return min_of(
      cie94_without_lightness(p.a, p.b, p.chroma, q.a, q.b, q.chroma, mean) * (1.0f / kLargestColourDifference), 1.0f);
}

}  // namespace lightcuts
