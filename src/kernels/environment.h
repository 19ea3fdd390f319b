#pragma once

#include "kernels/scene_view.h"
#include "math/warp.h"

namespace lightcuts {

/// Light from outside. A picture is constant within each texel, so that sampling it by its texels is exact.
struct EnvironmentView {
  Vec3 radiance;                                         ///< or the factor of the picture [W/(m^2 sr)]
  const float* planes[3] = {nullptr, nullptr, nullptr};  ///< R, G and B of the picture, or null
  std::int32_t width = 0, height = 0;
  /// Prefix sums of luminance times solid angle: over rows (height + 1), and within each row (height * (width + 1)).
  const double* rows = nullptr;
  const double* columns = nullptr;

  [[nodiscard]] LC_FN bool has_image() const { return planes[0] != nullptr; }
};

/// A sky direction (unit, towards the sky), what comes from there, and the density it was drawn with [1/sr].
struct EnvironmentSample {
  Vec3 direction;
  Vec3 radiance;
  float pdf = 0;
};

/// Texel values that are no radiance (negative, infinite, no number) count as black.
LC_KERNEL float usable_radiance(float v) { return v > 0 && v < kInfinity ? v : 0.0f; }

LC_KERNEL Vec3 environment_texel(const EnvironmentView& e, std::int32_t x, std::int32_t y) {
  const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(e.width) + static_cast<std::size_t>(x);
  return e.radiance *
         Vec3{usable_radiance(e.planes[0][i]), usable_radiance(e.planes[1][i]), usable_radiance(e.planes[2][i])};
}

/// Solid angle of one texel of row `y` [sr].
LC_KERNEL double environment_solid_angle(const EnvironmentView& e, std::int32_t y) {
  const double pi = 3.14159265358979323846, step = pi / e.height;
  return (std::cos(step * y) - std::cos(step * (y + 1))) * 2 * pi / e.width;
}

/// Index i of the interval [prefix[i], prefix[i + 1]) that holds u times the total of `prefix` from `first` to `last`;
/// never one without weight. Also returns where in the interval u fell, in [0, 1), and its share of the total.
struct Choice {
  std::uint32_t index = 0;
  double probability = 0;
  float rest = 0;
};
LC_KERNEL Choice sample_prefix(const double* prefix, std::uint32_t first, std::uint32_t last, double u) {
  const double total = prefix[last] - prefix[first], x = prefix[first] + u * total;
  std::uint32_t lo = first, hi = last - 1;  // the answer lies in [lo, hi]
  while (lo < hi) {
    const std::uint32_t middle = lo + (hi - lo + 1) / 2;
    if (prefix[middle] <= x) {
      lo = middle;
    } else {
      hi = middle - 1;
    }
  }
  while (lo > first && prefix[lo + 1] - prefix[lo] <= 0) --lo;  // x was rounded up to the very end
  const double width = prefix[lo + 1] - prefix[lo];
  Choice choice;
  choice.index = lo;
  choice.probability = total > 0 ? width / total : 0.0;
  const double rest = width > 0 ? (x - prefix[lo]) / width : 0.0;
  choice.rest = static_cast<float>(clamp_to(rest, 0.0, 0.99999994));
  return choice;
}

/// The picture's centre is seen along -z, its top along +y, and u grows to the right as seen from inside.
LC_KERNEL Vec3 environment_direction(float u, float cos_theta) {
  const float phi = 2 * kPi * (u - 0.5f), r = std::sqrt(max_of(0.0f, 1 - cos_theta * cos_theta));
  return {r * std::sin(phi), cos_theta, -r * std::cos(phi)};
}

/// Radiance that comes from `direction` (unit, towards the sky).
LC_KERNEL void find_environment_texel(const EnvironmentView& e, Vec3 direction, std::int32_t* x, std::int32_t* y) {
  const float u = 0.5f + std::atan2(direction.x, -direction.z) / (2 * kPi);
  const float v = std::acos(clamp_to(direction.y, -1.0f, 1.0f)) / kPi;
  *x = clamp_to(static_cast<std::int32_t>(u * static_cast<float>(e.width)), 0, e.width - 1);
  *y = clamp_to(static_cast<std::int32_t>(v * static_cast<float>(e.height)), 0, e.height - 1);
}
LC_KERNEL Vec3 eval_environment(const EnvironmentView& e, Vec3 direction) {
  if (!e.has_image()) return e.radiance;
  std::int32_t x = 0, y = 0;
  find_environment_texel(e, direction, &x, &y);
  return environment_texel(e, x, y);
}

LC_KERNEL float pdf_environment(const EnvironmentView& e, Vec3 direction) {
  if (!e.has_image()) return pdf_sphere();
  std::int32_t x = 0, y = 0;
  find_environment_texel(e, direction, &x, &y);
  const double* row = e.columns + static_cast<std::size_t>(y) * static_cast<std::size_t>(e.width + 1);
  return static_cast<float>((row[x + 1] - row[x]) / e.rows[e.height] / environment_solid_angle(e, y));
}

/// Draws a direction by luminance times solid angle.
LC_KERNEL EnvironmentSample sample_environment(const EnvironmentView& e, double u, double v) {
  if (!e.has_image()) {
    const Vec3 direction = sample_sphere({static_cast<float>(u), static_cast<float>(v)});
    return {direction, e.radiance, pdf_sphere()};
  }
  const Choice row = sample_prefix(e.rows, 0, static_cast<std::uint32_t>(e.height), v);
  const auto y = static_cast<std::int32_t>(row.index);
  const double* columns = e.columns + static_cast<std::size_t>(y) * static_cast<std::size_t>(e.width + 1);
  const Choice column = sample_prefix(columns, 0, static_cast<std::uint32_t>(e.width), u);
  const double pi = 3.14159265358979323846, step = pi / e.height;
  const double top = std::cos(step * y), bottom = std::cos(step * (y + 1));
  const auto cos_theta = static_cast<float>(top + (bottom - top) * static_cast<double>(row.rest));
  const float across = (static_cast<float>(column.index) + column.rest) / static_cast<float>(e.width);
  EnvironmentSample s;
  s.direction = environment_direction(across, cos_theta);
  s.radiance = environment_texel(e, static_cast<std::int32_t>(column.index), y);
  s.pdf = static_cast<float>(row.probability * column.probability / environment_solid_angle(e, y));
  return s;
}

}  // namespace lightcuts
