#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/colour_difference.h"
#include "lightcuts/math.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// Directions n with dot(axis, n) >= cos_half_angle, or n == axis where cos_half_angle is 1.
struct DirectionCone {
  Vec3 axis{0, 0, 1};
  float cos_half_angle = 1;
};

/// What a tree builder knows of a cluster.
struct LightCluster {
  Box box;             ///< positions, or unit directions towards directional lights
  DirectionCone cone;  ///< as in LightNode
  Vec3 intensity;      ///< sum
  Chromaticity color;  ///< of the summed intensity
  float luminance =
      0;  ///< of the summed intensity; builders keep it above 0, so that dark lights too have near and far
};

namespace detail {

/// Sine that belongs to a cosine, for angles in [0, pi].
template <class T>
LC_FN T sine_of(T cosine) {
  using std::sqrt;
  return sqrt(max_of((T(1) - cosine) * (T(1) + cosine), T(0)));
}

/// cos(angle of the axes + half angle), and -1 beyond pi.
LC_FN double cos_of_sum(double cos_p, double cos_q) {
  const double sin_p = sine_of(cos_p), sin_q = sine_of(cos_q);
  const bool beyond_pi = sin_p * cos_q + cos_p * sin_q < 0;
  return beyond_pi ? -1.0 : cos_p * cos_q - sin_p * sin_q;
}

/// Half angle of a cone about `axis` that contains `cone`, as a cosine, rounded to the safe side by more than float
/// axes can be off their unit length.
LC_FN float cosine_to_contain(Vec3 axis, const DirectionCone& cone) {
  if (cone.axis == axis) return cone.cos_half_angle;
  const double ax = axis.x, ay = axis.y, az = axis.z;
  const double cx = cone.axis.x, cy = cone.axis.y, cz = cone.axis.z;
  const double cos_axes = ax * cx + ay * cy + az * cz;
  const double sum = cos_of_sum(clamp_to(cos_axes - 1e-6, -1.0, 1.0), static_cast<double>(cone.cos_half_angle));
  return max_of(static_cast<float>(sum - 1e-6), -1.0f);
}

}  // namespace detail

/// A cone that contains two cones, hardly larger than the smallest one, in spite of rounding.
/// Source: the reference's section 1.3; the axis lies on the great circle through both axes. Without trigonometry: the
/// axis' place is found from unit vectors to the cones' far ends.
LC_FN DirectionCone unite(const DirectionCone& p, const DirectionCone& q) {
  if (p.axis == q.axis) return {p.axis, min_of(p.cos_half_angle, q.cos_half_angle)};
  const DirectionCone& wide = q.cos_half_angle < p.cos_half_angle ? q : p;
  const DirectionCone& narrow = q.cos_half_angle < p.cos_half_angle ? p : q;
  if (wide.cos_half_angle <= -1) return {wide.axis, -1.0f};
  if (detail::cosine_to_contain(wide.axis, narrow) >= wide.cos_half_angle) return wide;

  // In the plane of both axes: the far end of each cone, away from the other; the new axis halves the angle between.
  const float cos_axes = clamp_to(dot(p.axis, q.axis), -1.0f, 1.0f);
  const Vec3 across = q.axis - p.axis * cos_axes;
  const float across_length = length(across);
  if (!(across_length > 1e-6f)) {
    // Axes that agree but for rounding, or opposite ones.
    return cos_axes > 0
               ? DirectionCone{wide.axis, min_of(wide.cos_half_angle, detail::cosine_to_contain(wide.axis, narrow))}
               : DirectionCone{wide.axis, -1.0f};
  }
  const Vec3 side = across / across_length;
  const float sin_axes = across_length;
  const float cos_p = p.cos_half_angle, sin_p = detail::sine_of(cos_p);
  const float cos_q = q.cos_half_angle, sin_q = detail::sine_of(cos_q);
  // Directions at the angles -beta_p and gamma + beta_q, measured from p's axis towards q's.
  const float end_x = cos_axes * cos_q - sin_axes * sin_q, end_y = sin_axes * cos_q + cos_axes * sin_q;
  // Half of gamma + beta_p + beta_q, in [0, pi].
  const float cos_full = end_x * cos_p - end_y * sin_p, sin_full = end_y * cos_p + end_x * sin_p;
  const bool past_pi = sin_full < 0;
  if (!past_pi && sin_p * cos_q + cos_p * sin_q < 0) return {wide.axis, -1.0f};  // the sum went round
  const float cos_half = std::sqrt(max_of(0.5f * (1 + cos_full), 0.0f)) * (past_pi ? -1.0f : 1.0f);
  const float sin_half = std::sqrt(max_of(0.5f * (1 - cos_full), 0.0f));
  // The axis at the angle half - beta_p.
  const float axis_x = cos_half * cos_p + sin_half * sin_p, axis_y = sin_half * cos_p - cos_half * sin_p;
  const Vec3 axis = normalize(p.axis * axis_x + side * axis_y);
  return {axis, min_of(detail::cosine_to_contain(axis, p), detail::cosine_to_contain(axis, q))};
}

/// Cosine of the half angle of the cone around two cones, given the sines too. For metrics: without the axis, without
/// rounding to the safe side, and without a branch, so that compilers vectorise it.
LC_FN float united_cosine(const Vec3& axis_p, float cos_p, float sin_p, const Vec3& axis_q, float cos_q, float sin_q) {
  // From the chord: exactly 1 for equal axes.
  const Vec3 chord = axis_p - axis_q;
  const float cos_axes = max_of(1 - 0.5f * dot(chord, chord), -1.0f);
  const float sin_axes = detail::sine_of(cos_axes);
  const float cos_wide = min_of(cos_p, cos_q), cos_narrow = max_of(cos_p, cos_q);
  const float sin_narrow = cos_p < cos_q ? sin_q : sin_p;
  // The narrow cone reaches cos(gamma + beta_narrow) from the wide one's axis.
  const float reach = cos_axes * cos_narrow - sin_axes * sin_narrow;
  const float reach_sin = sin_axes * cos_narrow + cos_axes * sin_narrow;
  const bool contained = (reach >= cos_wide) & (reach_sin >= 0);
  // Half of the sum gamma + beta_p + beta_q, where the sum is below two pi.
  const float cos_both = cos_p * cos_q - sin_p * sin_q, sin_both = sin_p * cos_q + cos_p * sin_q;
  const float cos_full = cos_axes * cos_both - sin_axes * sin_both;
  const float sin_full = sin_axes * cos_both + cos_axes * sin_both;
  const float half = std::sqrt(max_of(0.5f + 0.5f * cos_full, 0.0f));
  const bool past_pi = sin_full < 0;
  // Half angles that sum to more than pi, and the whole sum beyond two pi: all directions.
  const bool everything = (sin_both < 0) & !past_pi;
  const float half_signed = past_pi ? -half : half;
  const float open = everything ? -1.0f : min_of(half_signed, cos_wide);
  return contained ? cos_wide : open;
}

/// Summary of two clusters as one.
LC_FN LightCluster unite(const LightCluster& p, const LightCluster& q) {
  LightCluster sum;
  sum.box = extend(p.box, q.box);
  sum.cone = unite(p.cone, q.cone);
  sum.intensity = p.intensity + q.intensity;
  sum.color = p.color == q.color ? p.color : chromaticity(sum.intensity);
  sum.luminance = p.luminance + q.luminance;
  return sum;
}

/// The constants of a metric for one kind of light.
struct MetricScale {
  Metric metric = Metric::walter;
  float inverse_extent = 1;       ///< 1 / alpha_S of the study's metrics [1/m]
  float direction_extent_sq = 0;  ///< c^2 of Walter's [m^2]: 0 for omnidirectional and directional lights
};

/// How much each term of the study's metrics counts: equal weights, 1 in all.
LC_FN float term_weight(Metric metric) {
  return metric == Metric::distance ? 1.0f : metric == Metric::distance_color_direction ? 1.0f / 3.0f : 0.5f;
}

/// Walter's size of the cluster that a merge would make: I (alpha^2 + c^2 (1 - cos beta)^2). Walter et al. 2005.
LC_FN float walter_size(float intensity, float diagonal_sq, float cos_beta, float direction_extent_sq) {
  const float spread = 1 - cos_beta;
  return intensity * (diagonal_sq + direction_extent_sq * spread * spread);
}

/// Size of the cluster that p and q would make, under the chosen metric: what a tree builder minimises. Symmetric to the
/// last bit. The study's metrics compare the summed colours and the cones' axes.
LC_FN float cluster_size(const LightCluster& p, const LightCluster& q, const MetricScale& scale) {
  const Vec3 extent = max_of(p.box.hi, q.box.hi) - min_of(p.box.lo, q.box.lo);
  const float diagonal_sq = dot(extent, extent);
  if (scale.metric == Metric::walter) {
    const float cos_p = p.cone.cos_half_angle, cos_q = q.cone.cos_half_angle;
    const float cos_beta = scale.direction_extent_sq > 0 ? united_cosine(p.cone.axis, cos_p, detail::sine_of(cos_p),
                                                                         q.cone.axis, cos_q, detail::sine_of(cos_q))
                                                         : 1.0f;
    return walter_size(p.luminance + q.luminance, diagonal_sq, cos_beta, scale.direction_extent_sq);
  }
  float sum = std::sqrt(diagonal_sq) * scale.inverse_extent;
  if (scale.metric == Metric::distance_color || scale.metric == Metric::distance_color_direction)
    sum += colour_difference(p.color, q.color);
  if (scale.metric == Metric::distance_direction || scale.metric == Metric::distance_color_direction)
    sum += 0.25f * length_sq(p.cone.axis - q.cone.axis);  // = 0.5 - 0.5 dot, exactly 0 for equal axes
  return sum * term_weight(scale.metric);
}

/// Random number in [0, 1) of a tree node: depends on the seed and on which lights lie below, never on the order in which
/// a builder came to it. The count tells a node from a child that has the same smallest and largest light: with one number
/// for both, the choices would not be independent.
LC_FN double representative_random(std::uint64_t seed, std::uint32_t smallest_light, std::uint32_t largest_light,
                                   std::uint32_t light_count) {
  std::uint64_t h = seed * 0x9e3779b97f4a7c15u + 0x632be59bd9b4e019u;
  const std::uint64_t words[3] = {smallest_light, largest_light, light_count};
  for (const std::uint64_t word : words) {
    h ^= word + 0x9e3779b97f4a7c15u + (h << 6) + (h >> 2);
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
    h ^= h >> 31;
  }
  return static_cast<double>(h >> 11) * 0x1.0p-53;
}

/// True where the cluster of light range [lo, hi] takes the representative of p rather than q: with probability
/// I_p / (I_p + I_q). Where neither shines, p's.
LC_FN bool first_represents(double luminance_p, double luminance_q, double random) {
  const double sum = luminance_p + luminance_q;
  return !(sum > 0) || random * sum < luminance_p;
}

}  // namespace lightcuts
