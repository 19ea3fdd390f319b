#pragma once

#include <cmath>

#include "lightcuts/math.h"

namespace lightcuts {

// What one light does to one receiver, without visibility: the only place where this is written. Instant Radiosity, the
// cut and its representatives, the CPU's SIMD lanes and CUDA threads all evaluate these templates. The number type T is
// `float` (a CUDA thread, plain code), `double` (oracles) or a register of SIMD lanes that brings its own overloads of
// the four operations below.
//
// Every factor has to be multiplied by the light's intensity and by the receiver's albedo / pi.

LC_FN float select(bool condition, float yes, float no) { return condition ? yes : no; }
LC_FN double select(bool condition, double yes, double no) { return condition ? yes : no; }
LC_FN float reciprocal(float v) { return 1.0f / v; }
LC_FN double reciprocal(double v) { return 1.0 / v; }
LC_FN float square_root(float v) { return std::sqrt(v); }
LC_FN double square_root(double v) { return std::sqrt(v); }

/// Added to a squared squared distance [m^4] so that lights at the receiver's very place give 0 and not NaN; it changes
/// nothing at distances above 1e-8 m.
inline constexpr float kTinyDistance4 = 1e-37f;

/// A point or spot light falls off by the inverse square without the clamp of VPLs, for its singularity is real.
/// Only below a distance of 1e-6 m is it held constant, so that no infinity arises [m^2].
inline constexpr float kPointGuardSq = 1e-12f;

/// Coordinates of surfaces and lights must stay below this [m], which validate() ensures for scenes: the fourth power of
/// a distance then fits into a float, and no infinity or NaN arises from finite input.
inline constexpr float kLargestLitCoordinate = 1e9f;

/// A point of a surface that receives light. `Flat` says that both normals agree, which spares a comparison.
template <class T, bool Flat = false>
struct Receiver {
  Vec3T<T> position;  ///< [m], world space
  Vec3T<T> ns;        ///< unit shading normal on the viewer's side; zero for lanes without a surface
  Vec3T<T> ng;        ///< unit geometric normal on the viewer's side; unused where Flat
};

/// Cosine at the receiver times the length of `to_light`: by the shading normal, 0 where the geometric one disagrees.
template <class T, bool Flat>
LC_FN T receiver_cosine(const Receiver<T, Flat>& receiver, Vec3T<T> to_light) {
  const T by_shading = max_of(dot(receiver.ns, to_light), T(0.0f));
  if constexpr (Flat) {
    return by_shading;
  } else {
    return select(dot(receiver.ng, to_light) > T(0.0f), by_shading, T(0.0f));
  }
}

/// Geometric factor of a VPL at a receiver [1/m^2], with and without the clamp.
template <class T>
struct VplFactor {
  T clamped;      ///< cos_y cos_x / max(d^2, d_c^2)
  T unclamped;    ///< cos_y cos_x / d^2: what the clamp takes is counted with it
  T distance_sq;  ///< d^2 [m^2]
};

/// Geometric factor of an oriented light (VPL or area-light sample) at a receiver.
///
/// @param min_distance_sq  square of the clamp d_c that hides the VPL singularity [m^2], 0: no clamp
///
/// The clamp is on the distance, and only on the falloff: the cosines are the true ones. Bounds of clusters must use the
/// same. At distance 0 the factor is 0. Source: reference 02-algorithms, equation 3.5 and section 9.1.
template <class T, bool Flat>
LC_FN VplFactor<T> vpl_factor(const Receiver<T, Flat>& receiver, Vec3T<T> position, Vec3T<T> axis, T min_distance_sq) {
  // Nothing is negated, for compilers do that again for every light: the light's cosine and the denominator both stay
  // negative instead.
  const Vec3T<T> to_light = position - receiver.position;
  const T distance_sq = length_sq(to_light);
  const T cos_receiver = receiver_cosine(receiver, to_light);      // times d
  const T minus_cos_light = min_of(dot(axis, to_light), T(0.0f));  // times d
  const T minus_cosines = cos_receiver * minus_cos_light;          // times d^2
  return {minus_cosines * reciprocal(T(-kTinyDistance4) - distance_sq * max_of(distance_sq, min_distance_sq)),
          minus_cosines * reciprocal(T(-kTinyDistance4) - distance_sq * distance_sq), distance_sq};
}

/// What a point or spot light needs beside its intensity; see PointLight.
template <class T>
struct Spot {
  Vec3T<T> position;  ///< [m]
  Vec3T<T> axis;      ///< unit
  T cos_outer;        ///< -2 for a light that shines everywhere
  T inverse_range;    ///< 1 / (cos_inner - cos_outer)
};

/// Geometric factor of a point or spot light at a receiver [1/m^2]: cos_y s^2 / d^2, s the spot's edge.
///
/// Unclamped inverse square, but for the guard kPointGuardSq. Source: KHR_lights_punctual.
template <class T, bool Flat>
LC_FN T point_factor(const Receiver<T, Flat>& receiver, const Spot<T>& spot) {
  const Vec3T<T> to_light = spot.position - receiver.position;
  const T distance_sq = max_of(length_sq(to_light), T(kPointGuardSq));
  const T inverse_distance = reciprocal(square_root(distance_sq));
  const T cos_receiver = receiver_cosine(receiver, to_light) * inverse_distance;
  const T cos_spot = T(0.0f) - dot(spot.axis, to_light) * inverse_distance;
  const T edge = min_of(max_of((cos_spot - spot.cos_outer) * spot.inverse_range, T(0.0f)), T(1.0f));
  return cos_receiver * edge * edge * (inverse_distance * inverse_distance);
}

/// Geometric factor of a directional light at a receiver: cos_y. `direction` is unit, the way the light travels.
template <class T, bool Flat>
LC_FN T directional_factor(const Receiver<T, Flat>& receiver, Vec3T<T> direction) {
  return receiver_cosine(receiver, -direction);
}

}  // namespace lightcuts
