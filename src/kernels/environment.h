#pragma once

#include "kernels/scene_view.h"
#include "math/warp.h"

namespace lightcuts {

/// Light from outside. A picture is interpolated between the centres of its texels, around the horizon too, wherever it is
/// looked up: seen directly, met by a path, or drawn.
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

/// Texel with the neighbours of the seam and, above and below the picture, the outermost rows.
LC_KERNEL Vec3 environment_neighbour(const EnvironmentView& e, std::int32_t x, std::int32_t y) {
  const std::int32_t column = x < 0 ? x + e.width : x >= e.width ? x - e.width : x;
  return environment_texel(e, column, clamp_to(y, 0, e.height - 1));
}

/// The four texels around a point of the picture, (0, 0) its top left corner, (1, 1) its bottom right one: (x, y) and its
/// neighbours at x + 1 and y + 1, which may lie past the border, with their weights.
struct InterpolatedTexels {
  std::int32_t x, y;
  float left, right, above, below;
};
LC_KERNEL InterpolatedTexels interpolated_texels(const EnvironmentView& e, Vec2 at) {
  const float x = at.x * static_cast<float>(e.width) - 0.5f, y = at.y * static_cast<float>(e.height) - 0.5f;
  const float column = std::floor(x), row = std::floor(y), right = x - column, below = y - row;
  return {clamp_to(static_cast<std::int32_t>(column), -1, e.width - 1),
          clamp_to(static_cast<std::int32_t>(row), -1, e.height - 1),
          1 - right,
          right,
          1 - below,
          below};
}

/// Radiance at a point of the picture.
LC_KERNEL Vec3 interpolate_environment(const EnvironmentView& e, Vec2 at) {
  const InterpolatedTexels t = interpolated_texels(e, at);
  return (environment_neighbour(e, t.x, t.y) * t.left + environment_neighbour(e, t.x + 1, t.y) * t.right) * t.above +
         (environment_neighbour(e, t.x, t.y + 1) * t.left + environment_neighbour(e, t.x + 1, t.y + 1) * t.right) *
             t.below;
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
LC_KERNEL Vec3 environment_direction(Vec2 at) {
  const float phi = 2 * kPi * (at.x - 0.5f), theta = kPi * at.y, r = std::sin(theta);
  return {r * std::sin(phi), std::cos(theta), -r * std::cos(phi)};
}

/// The point of the picture that lies in `direction` (unit, towards the sky).
LC_KERNEL Vec2 environment_point(Vec3 direction) {
  return {0.5f + std::atan2(direction.x, -direction.z) / (2 * kPi),
          std::atan2(std::sqrt(direction.x * direction.x + direction.z * direction.z), direction.y) / kPi};
}
LC_KERNEL void find_environment_texel(const EnvironmentView& e, Vec3 direction, std::int32_t* x, std::int32_t* y) {
  const Vec2 at = environment_point(direction);
  *x = clamp_to(static_cast<std::int32_t>(at.x * static_cast<float>(e.width)), 0, e.width - 1);
  *y = clamp_to(static_cast<std::int32_t>(at.y * static_cast<float>(e.height)), 0, e.height - 1);
}

/// Radiance that comes from `direction` (unit, towards the sky).
LC_KERNEL Vec3 eval_environment(const EnvironmentView& e, Vec3 direction) {
  if (!e.has_image()) return e.radiance;
  return interpolate_environment(e, environment_point(direction));
}

/// Probability with which sample_environment starts from a texel, one of the neighbours of the seam or of a pole.
LC_KERNEL float environment_share(const EnvironmentView& e, std::int32_t x, std::int32_t y) {
  const std::int32_t column = x < 0 ? x + e.width : x >= e.width ? x - e.width : x;
  const double* row =
      e.columns + static_cast<std::size_t>(clamp_to(y, 0, e.height - 1)) * static_cast<std::size_t>(e.width + 1);
  return static_cast<float>((row[column + 1] - row[column]) / e.rows[e.height]);
}

/// Density per steradian at a point of the picture: tents around the texels' centres add up to the interpolation of their
/// probabilities. It is about proportional to the luminance, so all samples carry about as much.
LC_KERNEL float pdf_environment_at(const EnvironmentView& e, Vec2 at) {
  const InterpolatedTexels t = interpolated_texels(e, at);
  const float share =
      t.above * (t.left * environment_share(e, t.x, t.y) + t.right * environment_share(e, t.x + 1, t.y)) +
      t.below * (t.left * environment_share(e, t.x, t.y + 1) + t.right * environment_share(e, t.x + 1, t.y + 1));
  const float texels = static_cast<float>(e.width) * static_cast<float>(e.height);
  return share * texels / (2 * kPi * kPi * max_of(std::sin(kPi * at.y), 1e-6f));
}

LC_KERNEL float pdf_environment(const EnvironmentView& e, Vec3 direction) {
  return e.has_image() ? pdf_environment_at(e, environment_point(direction)) : pdf_sphere();
}

/// From uniform to a tent over (-1, 1).
LC_KERNEL float sample_tent(float u) { return u < 0.5f ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u); }

/// Draws a direction: a texel by luminance times solid angle, then an offset from its centre by a tent, around the horizon
/// and back from the poles.
LC_KERNEL EnvironmentSample sample_environment(const EnvironmentView& e, double u, double v) {
  if (!e.has_image()) {
    const Vec3 direction = sample_sphere({static_cast<float>(u), static_cast<float>(v)});
    return {direction, e.radiance, pdf_sphere()};
  }
  const Choice row = sample_prefix(e.rows, 0, static_cast<std::uint32_t>(e.height), v);
  const double* columns = e.columns + std::size_t{row.index} * static_cast<std::size_t>(e.width + 1);
  const Choice column = sample_prefix(columns, 0, static_cast<std::uint32_t>(e.width), u);
  Vec2 at{(static_cast<float>(column.index) + 0.5f + sample_tent(column.rest)) / static_cast<float>(e.width),
          (static_cast<float>(row.index) + 0.5f + sample_tent(row.rest)) / static_cast<float>(e.height)};
  at.x = at.x < 0 ? at.x + 1 : at.x >= 1 ? at.x - 1 : at.x;
  at.y = at.y < 0 ? -at.y : at.y > 1 ? 2 - at.y : at.y;
  return {environment_direction(at), interpolate_environment(e, at), pdf_environment_at(e, at)};
}

}  // namespace lightcuts
