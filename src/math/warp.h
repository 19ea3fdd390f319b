#pragma once

#include "lightcuts/math.h"

namespace lightcuts {

/// Of one angle.
struct SinCos {
  float sin, cos;
};

/// Sine and cosine of an angle from -pi / 4 to pi / 4 [rad], to two units of rounding: Taylor's series.
///
/// Every processor rounds these operations alike, where libraries differ in the last bit: a photon that starts a bit to the
/// side may hit another triangle.
LC_FN SinCos small_sin_cos(float x) {
  const float z = x * x;
  return {x + x * z * (-1.0f / 6 + z * (1.0f / 120 + z * (-1.0f / 5040 + z * (1.0f / 362880)))),
          1 + z * (-0.5f + z * (1.0f / 24 + z * (-1.0f / 720 + z * (1.0f / 40320))))};
}

/// Sine and cosine of an angle in full circles, of any size; their error is that of the turn's own rounding and two units.
LC_KERNEL SinCos sin_cos_of_turn(float turn) {
  const float quarter = std::floor(4 * turn + 0.5f);
  const SinCos rest = small_sin_cos(2 * kPi * (turn - 0.25f * quarter));
  switch (static_cast<int>(quarter) & 3) {
    case 0:
      return rest;
    case 1:
      return {rest.cos, -rest.sin};
    case 2:
      return {-rest.sin, -rest.cos};
    default:
      return {-rest.cos, rest.sin};
  }
}

// Maps from the unit square to the shapes that light is sampled on. `sample_x` draws, `pdf_x` is its density.

/// Point of the unit disc, uniform; continuous and area-preserving, so that stratification survives.
/// Source: Shirley and Chiu 1997; the form with a signed radius.
LC_KERNEL Vec2 sample_disc(Vec2 u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {0, 0};
  const bool wide = a * a > b * b;
  const float r = wide ? a : b;
  // The angle from the nearer axis.
  const SinCos phi = small_sin_cos((kPi / 4) * (wide ? b / a : a / b));
  return wide ? Vec2{r * phi.cos, r * phi.sin} : Vec2{r * phi.sin, r * phi.cos};
}
LC_FN float pdf_disc() { return kInvPi; }

/// Unit direction around +z with density cos / pi per steradian. Source: Malley's method on the concentric map.
LC_KERNEL Vec3 sample_cosine_hemisphere(Vec2 u) {
  const Vec2 d = sample_disc(u);
  return {d.x, d.y, std::sqrt(max_of(0.0f, 1 - d.x * d.x - d.y * d.y))};
}
LC_FN float pdf_cosine_hemisphere(float cos_theta) { return max_of(cos_theta, 0.0f) * kInvPi; }

/// Barycentric weights (x, y) of corners 1 and 2, uniform by area; the density is 1 / area.
LC_KERNEL Vec2 sample_triangle(Vec2 u) {
  const float s = std::sqrt(u.x);
  return {s * (1 - u.y), s * u.y};
}

/// Unit direction whose cosine with +z is `z`, turned by `turn` full circles.
LC_KERNEL Vec3 direction_from_cosine(float z, float turn) {
  const float r = std::sqrt(max_of(0.0f, 1 - z * z));
  const SinCos phi = sin_cos_of_turn(turn);
  return {r * phi.cos, r * phi.sin, z};
}

/// Unit direction, uniform over the sphere.
LC_KERNEL Vec3 sample_sphere(Vec2 u) { return direction_from_cosine(1 - 2 * u.x, u.y); }
LC_FN float pdf_sphere() { return kInvPi / 4; }

}  // namespace lightcuts
