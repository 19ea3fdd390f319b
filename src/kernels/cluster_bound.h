#pragma once

#include <cmath>

#include "kernels/light_cluster.h"
#include "lightcuts/math.h"

/// Bounds on what any light of a cluster can send to a point. Every function is a template on the number type T: `float`
/// on a CUDA thread, `double` in oracles, `xsimd::batch<float>` with one receiver a lane. Clusters are uniform over lanes.
/// Boxes and cones are those of LightNode.
///
/// Never below the true value for any light inside box and cone, in spite of rounding: what a subtraction can lose is
/// added before anything is divided, the rest is covered by a last factor.
namespace lightcuts {

/// Point that is lit, and the unit normal of the side that is.
template <class T>
struct LitPoint {
  Vec3T<T> position, normal;
};

/// Clamps below this distance count as it [m]: a bound must be finite.
inline constexpr float kSmallestClamp = 1e-9f;

namespace lanes {

// The scalar versions of what a SIMD library offers for batches, where argument-dependent lookup finds it.
LC_FN float min(float a, float b) { return b < a ? b : a; }
LC_FN float max(float a, float b) { return a < b ? b : a; }
LC_FN float abs(float a) { return a < 0 ? -a : a; }
LC_FN float select(bool condition, float a, float b) { return condition ? a : b; }
LC_FN double min(double a, double b) { return b < a ? b : a; }
LC_FN double max(double a, double b) { return a < b ? b : a; }
LC_FN double abs(double a) { return a < 0 ? -a : a; }
LC_FN double select(bool condition, double a, double b) { return condition ? a : b; }
using std::sqrt;
/// 1 / sqrt(v), which processors have an instruction for.
LC_FN float inverse_sqrt(float v) { return 1 / std::sqrt(v); }
LC_FN double inverse_sqrt(double v) { return 1 / std::sqrt(v); }

}  // namespace lanes

namespace detail {

inline constexpr float kProjectionSlack = 6e-7f;  ///< of a sum of three products, relative to the sum of their sizes
inline constexpr float kAcrossSlack = 3e-6f;      ///< of a distance to an axis, relative to the vectors' sizes
inline constexpr float kBoundFactor = 1 + 1e-5f;  ///< of everything that follows

/// A box of vectors from some point, and its distances.
template <class T>
struct VectorBox {
  Vec3T<T> lo, hi;
  Vec3T<T> middle, half;
  T distance_min_sq, distance_max_sq;
};

template <class T>
LC_FN VectorBox<T> vector_box(Vec3T<T> lo, Vec3T<T> hi) {
  using lanes::max;
  VectorBox<T> box{lo, hi, (lo + hi) * T(0.5f), (hi - lo) * T(0.5f), T(0), T(0)};
  const T zero(0);
  const T x = max(max(lo.x, -hi.x), zero), y = max(max(lo.y, -hi.y), zero), z = max(max(lo.z, -hi.z), zero);
  box.distance_min_sq = x * x + y * y + z * z;
  const T far_x = max(-lo.x, hi.x), far_y = max(-lo.y, hi.y), far_z = max(-lo.z, hi.z);
  box.distance_max_sq = far_x * far_x + far_y * far_y + far_z * far_z;
  return box;
}

/// Lights' positions as seen from a receiver.
template <class T>
LC_FN VectorBox<T> lights_from(Vec3T<T> receiver, const Box& box) {
  return vector_box<T>({T(box.lo.x) - receiver.x, T(box.lo.y) - receiver.y, T(box.lo.z) - receiver.z},
                       {T(box.hi.x) - receiver.x, T(box.hi.y) - receiver.y, T(box.hi.z) - receiver.z});
}

/// The same vectors the other way round.
template <class T>
LC_FN VectorBox<T> reversed(const VectorBox<T>& box) {
  return {-box.hi, -box.lo, -box.middle, box.half, box.distance_min_sq, box.distance_max_sq};
}

/// A box of vectors along a unit axis and across it.
template <class T>
struct AxisExtent {
  T lo, hi;     ///< along
  T across_sq;  ///< smallest squared distance from the axis' line
};

/// The frame's second axis points to the box' middle: there the box is narrowest as seen from the line.
template <class T>
LC_FN AxisExtent<T> extent_along(Vec3T<T> axis, const VectorBox<T>& box) {
  using lanes::abs;
  using lanes::inverse_sqrt;
  using lanes::max;
  using lanes::min;
  using lanes::sqrt;
  const T ax = axis.x * box.lo.x, bx = axis.x * box.hi.x;
  const T ay = axis.y * box.lo.y, by = axis.y * box.hi.y;
  const T az = axis.z * box.lo.z, bz = axis.z * box.hi.z;
  const T slack = T(kProjectionSlack) * (max(abs(ax), abs(bx)) + max(abs(ay), abs(by)) + max(abs(az), abs(bz)));
  AxisExtent<T> extent;
  extent.lo = min(ax, bx) + min(ay, by) + min(az, bz) - slack;
  extent.hi = max(ax, bx) + max(ay, by) + max(az, bz) + slack;

  const Vec3T<T> off = box.middle - axis * dot(axis, box.middle);
  const T off_sq = dot(off, off);
  const T inverse = inverse_sqrt(max(off_sq, T(1e-36f)));
  const T reach = (abs(off.x) * box.half.x + abs(off.y) * box.half.y + abs(off.z) * box.half.z) * inverse;
  const T size = sqrt(box.distance_max_sq);
  const T across = max(off_sq * inverse - reach - T(kAcrossSlack) * size, T(0));
  extent.across_sq = across * across;
  return extent;
}

/// Largest cosine between the axis and any vector of the box, negative where all point away. The reference's
/// equation (1.5), with the box' own distances where they are better.
template <class T>
LC_FN T cosine_bound(const AxisExtent<T>& extent, const VectorBox<T>& box) {
  using lanes::inverse_sqrt;
  using lanes::max;
  using lanes::min;
  using lanes::select;
  const T nearest_sq = max(box.distance_min_sq, extent.across_sq + extent.hi * extent.hi);
  const T distance_sq = select(extent.hi >= T(0), nearest_sq, box.distance_max_sq);
  return min(max(extent.hi * inverse_sqrt(max(distance_sq, T(1e-36f))), T(-1)), T(1));
}

/// Largest cos+ / max(d^2, clamp^2) of any vector of the box, cos towards the axis: one bound of both, which never are
/// largest at the same vector.
///
/// With z along and r across, d >= max(sqrt(r^2 + z^2), d_min). For given z the nearest is best; z / (d max(d^2, clamp^2))
/// then grows until d leaves max(d_min, clamp), and from there until z = r / sqrt(2).
template <class T>
LC_FN T cosine_falloff_bound(const AxisExtent<T>& extent, const VectorBox<T>& box, T clamp_sq) {
  using lanes::inverse_sqrt;
  using lanes::max;
  using lanes::min;
  using lanes::select;
  using lanes::sqrt;
  const T held_sq = max(max(box.distance_min_sq, clamp_sq) - extent.across_sq, T(0.5f) * extent.across_sq);
  const T z = min(max(sqrt(held_sq), extent.lo), extent.hi);
  const T d_sq = max(box.distance_min_sq, extent.across_sq + z * z);
  const T bound = z * inverse_sqrt(max(d_sq, T(1e-36f))) / max(d_sq, clamp_sq);
  return select(extent.hi > T(0), max(bound, T(0)), T(0));
}

}  // namespace detail

/// Largest cos+(receiver) cos+(emitter) / max(d^2, clamp^2) [1/m^2] that any light of a cluster of VPLs has at a point.
///
/// @param box       of the lights' positions [m]
/// @param cone      of their axes
/// @param clamp_sq  square of the distance below which the falloff stays constant [m^2]
/// Times the albedo over pi and the cluster's intensity it bounds both the lights' exact sum and its estimate by one light.
/// Source: Walter et al. 2005; cosines as in the reference's section 1.7, receiver's cosine and distance bounded together.
template <class T>
LC_FN T vpl_bound(const LitPoint<T>& receiver, const Box& box, const DirectionCone& cone, T clamp_sq) {
  using lanes::max;
  using lanes::min;
  using lanes::select;
  using lanes::sqrt;
  const T clamped_sq = max(clamp_sq, T(kSmallestClamp * kSmallestClamp));
  const detail::VectorBox<T> to_lights = detail::lights_from(receiver.position, box);
  const detail::VectorBox<T> from_lights = detail::reversed(to_lights);
  const detail::AxisExtent<T> seen = detail::extent_along(receiver.normal, to_lights);
  const Vec3T<T> axis{T(cone.axis.x), T(cone.axis.y), T(cone.axis.z)};
  const detail::AxisExtent<T> sent = detail::extent_along(axis, from_lights);

  // The emitter's cosine: towards the axis of the cone, less the cone's half angle. The reference's equation (1.6).
  const T cos_half(cone.cos_half_angle), sin_half(detail::sine_of(cone.cos_half_angle));
  const T cos_axis = detail::cosine_bound(sent, from_lights);
  const T sin_axis = sqrt(max((T(1) - cos_axis) * (T(1) + cos_axis), T(0)));
  const T cos_emitter = select(cos_axis >= cos_half, T(1), max(cos_axis * cos_half + sin_axis * sin_half, T(0)));

  // Either cosine goes together with the distance; the smaller product holds. For the emitter's, with the angle t to the
  // axis, cos(t - half) <= cos+(t) + sin(half), or 1 for cones wider than a half space.
  const T by_receiver = detail::cosine_falloff_bound(seen, to_lights, clamped_sq) * cos_emitter;
  const T cos_receiver = max(detail::cosine_bound(seen, to_lights), T(0));
  const T falloff = T(1) / max(to_lights.distance_min_sq, clamped_sq);
  const T tilt = select(cos_half >= T(0), sin_half, T(1));
  const T by_emitter = cos_receiver * (detail::cosine_falloff_bound(sent, from_lights, clamped_sq) + tilt * falloff);
  return min(by_receiver, by_emitter) * T(detail::kBoundFactor);
}

/// Largest cos+(receiver) / max(d^2, clamp^2) [1/m^2] of any light of a cluster of point and spot lights that shines
/// towards the point at all. `cone` holds every direction into which one shines; its falloff to the rim is not used.
template <class T>
LC_FN T point_bound(const LitPoint<T>& receiver, const Box& box, const DirectionCone& cone, T clamp_sq) {
  using lanes::max;
  using lanes::select;
  const detail::VectorBox<T> to_lights = detail::lights_from(receiver.position, box);
  const detail::VectorBox<T> from_lights = detail::reversed(to_lights);
  const Vec3T<T> axis{T(cone.axis.x), T(cone.axis.y), T(cone.axis.z)};
  const T cos_axis = detail::cosine_bound(detail::extent_along(axis, from_lights), from_lights);
  const T bound = detail::cosine_falloff_bound(detail::extent_along(receiver.normal, to_lights), to_lights,
                                               max(clamp_sq, T(kSmallestClamp * kSmallestClamp)));
  return select(cos_axis + T(2e-6f) >= T(cone.cos_half_angle), bound * T(detail::kBoundFactor), T(0));
}

/// Largest cos+(receiver) of any light of a cluster of directional lights; `directions` bounds the unit vectors to them.
template <class T>
LC_FN T directional_bound(Vec3T<T> normal, const Box& directions) {
  using lanes::max;
  using lanes::min;
  using lanes::sqrt;
  const detail::VectorBox<T> box = detail::lights_from(Vec3T<T>{T(0), T(0), T(0)}, directions);
  const detail::AxisExtent<T> extent = detail::extent_along(normal, box);
  // The vectors themselves have length 1, whatever else is in the box.
  const T length_sq = max(T(1), extent.across_sq + extent.hi * extent.hi);
  return min(max(extent.hi / sqrt(length_sq), T(0)) * T(detail::kBoundFactor), T(1));
}

}  // namespace lightcuts
