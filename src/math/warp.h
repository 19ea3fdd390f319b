#pragma once

#include "lightcuts/math.h"

namespace lightcuts {

// Maps from the unit square to the shapes that light is sampled on. `sample_x` draws, `pdf_x` is its density.

/// Point of the unit disc, uniform; continuous and area-preserving, so that stratification survives.
/// Source: Shirley and Chiu 1997; the form with a signed radius.
LC_KERNEL Vec2 sample_disc(Vec2 u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {0, 0};
  const bool wide = a * a > b * b;
  const float r = wide ? a : b;
  const float phi = wide ? (kPi / 4) * (b / a) : (kPi / 2) - (kPi / 4) * (a / b);
  return {r * std::cos(phi), r * std::sin(phi)};
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
  const float r = std::sqrt(max_of(0.0f, 1 - z * z)), phi = 2 * kPi * turn;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// Unit direction, uniform over the sphere.
LC_KERNEL Vec3 sample_sphere(Vec2 u) { return direction_from_cosine(1 - 2 * u.x, u.y); }
LC_FN float pdf_sphere() { return kInvPi / 4; }

}  // namespace lightcuts
