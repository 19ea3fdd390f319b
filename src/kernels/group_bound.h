#pragma once

#include "kernels/cluster_bound.h"
#include "kernels/light_cluster.h"
#include "lightcuts/math.h"

/// Bounds on what any light of a cluster can send to any point of a group of receivers: one test serves many pixels.
/// Every function is a template on the number type T: `float` on a CUDA thread, `double` in oracles, and
/// `xsimd::batch<float>` with one cluster a lane, the group being the same in all lanes. For a group of one receiver they
/// are the bounds of cluster_bound.h.
namespace lightcuts {

/// Receivers that are lit together.
template <class T>
struct ReceiverGroup {
  Vec3T<T> lo, hi;         ///< box of the positions [m]
  Vec3T<T> axis;           ///< of the cone of the normals
  T cos_half_angle;        ///< of that cone; 1: all normals are the axis
  T sin_half_angle;        ///< the same as a sine
  T gain_lo{}, gain_hi{};  ///< by how much the box is too long at its lower and upper end along the axis [m], >= 0
};

/// Boxes and cones of clusters of lights, as in LightNode.
template <class T>
struct ClusterBounds {
  Vec3T<T> lo, hi;
  Vec3T<T> axis;
  T cos_half_angle;
};

// --- A group from its receivers: first box and sum of the normals, then cone and gains. Reductions by min, max and sum. ---

/// Axis of the cone of normals, from their sum; `any` is one of them, for normals that cancel out. `all_same` keeps it
/// exact where every normal is the same.
LC_FN Vec3 group_axis(Vec3 sum_of_normals, Vec3 any, bool all_same) {
  const float size_sq = dot(sum_of_normals, sum_of_normals);
  return all_same || !(size_sq > 1e-6f) ? any : sum_of_normals * (1 / std::sqrt(size_sq));
}

/// Cosine by which the cone about `axis` has to hold a normal: the smallest one of all normals counts.
LC_FN float group_cosine(Vec3 axis, Vec3 normal) {
  return axis == normal ? 1.0f : max_of(dot(axis, normal) - 1e-6f, -1.0f);
}

/// How far a receiver is from the upper end of the box along an axis [m]. The smallest over all receivers is the group's
/// `gain_hi`, and with the axis reversed its `gain_lo`. Every term is at least 0, so nothing cancels out.
LC_FN float gap_to_end(Vec3 axis, const Box& box, Vec3 p) {
  const float x = axis.x > 0 ? axis.x * (box.hi.x - p.x) : axis.x * (box.lo.x - p.x);
  const float y = axis.y > 0 ? axis.y * (box.hi.y - p.y) : axis.y * (box.lo.y - p.y);
  const float z = axis.z > 0 ? axis.z * (box.hi.z - p.z) : axis.z * (box.lo.z - p.z);
  return (x + y + z) * (1 - 1e-6f);
}

/// A group as the bounds want it.
template <class T>
LC_FN ReceiverGroup<T> receiver_group(const Box& box, Vec3 axis, float cos_half_angle, float gain_lo, float gain_hi) {
  return {{T(box.lo.x), T(box.lo.y), T(box.lo.z)},
          {T(box.hi.x), T(box.hi.y), T(box.hi.z)},
          {T(axis.x), T(axis.y), T(axis.z)},
          T(cos_half_angle),
          T(detail::sine_of(cos_half_angle)),
          T(gain_lo),
          T(gain_hi)};
}

namespace detail {

/// All vectors from a receiver to a light.
template <class T>
LC_FN VectorBox<T> lights_from(const ReceiverGroup<T>& group, const ClusterBounds<T>& lights) {
  return vector_box<T>(lights.lo - group.hi, lights.hi - group.lo);
}

/// The same along the axis of the normals, where the receivers' extent is known better.
template <class T>
LC_FN AxisExtent<T> extent_seen(const ReceiverGroup<T>& group, const VectorBox<T>& box) {
  AxisExtent<T> extent = extent_along(group.axis, box);
  extent.lo = extent.lo + group.gain_hi;
  extent.hi = extent.hi - group.gain_lo;
  return extent;
}

/// Largest cosine, at least 0, to any direction of a cone, from the largest cosine to its axis. The reference's equation
/// (1.6).
template <class T>
LC_FN T cosine_to_cone(T cos_axis, T cos_half, T sin_half) {
  using lanes::max;
  using lanes::select;
  using lanes::sqrt;
  const T sin_axis = sqrt(max((T(1) - cos_axis) * (T(1) + cos_axis), T(0)));
  return select(cos_axis >= cos_half, T(1), max(cos_axis * cos_half + sin_axis * sin_half, T(0)));
}

/// By how much cos+ to some direction of a cone can exceed cos+ to its axis: cos(t - half) <= cos+(t) + sin(half).
template <class T>
LC_FN T tilt_of(T cos_half, T sin_half) {
  using lanes::select;
  return select(cos_half >= T(0), sin_half, T(1));
}

}  // namespace detail

/// Largest cos+(receiver) cos+(emitter) / max(d^2, clamp^2) [1/m^2] that any light of a cluster of VPLs has at any
/// receiver of a group; otherwise as vpl_bound, and for one receiver the same.
template <class T>
LC_FN T group_vpl_bound(const ReceiverGroup<T>& group, const ClusterBounds<T>& lights, T clamp_sq) {
  using lanes::max;
  using lanes::min;
  using lanes::sqrt;
  const T clamped_sq = max(clamp_sq, T(kSmallestClamp * kSmallestClamp));
  const detail::VectorBox<T> to_lights = detail::lights_from(group, lights);
  const detail::VectorBox<T> from_lights = detail::reversed(to_lights);
  const detail::AxisExtent<T> seen = detail::extent_seen(group, to_lights);
  const detail::AxisExtent<T> sent = detail::extent_along(lights.axis, from_lights);

  const T cos_half = lights.cos_half_angle;
  const T sin_half = sqrt(max((T(1) - cos_half) * (T(1) + cos_half), T(0)));
  const T cos_emitter = detail::cosine_to_cone(detail::cosine_bound(sent, from_lights), cos_half, sin_half);
  const T cos_receiver =
      detail::cosine_to_cone(detail::cosine_bound(seen, to_lights), group.cos_half_angle, group.sin_half_angle);

  // Either cosine goes together with the distance; the smaller product holds.
  const T falloff = T(1) / max(to_lights.distance_min_sq, clamped_sq);
  const T by_receiver = cos_emitter * (detail::cosine_falloff_bound(seen, to_lights, clamped_sq) +
                                       detail::tilt_of(group.cos_half_angle, group.sin_half_angle) * falloff);
  const T by_emitter = cos_receiver * (detail::cosine_falloff_bound(sent, from_lights, clamped_sq) +
                                       detail::tilt_of(cos_half, sin_half) * falloff);
  return min(min(by_receiver, by_emitter), cos_emitter * cos_receiver * falloff) * T(detail::kBoundFactor);
}

/// Largest cos+(receiver) / max(d^2, clamp^2) [1/m^2] of any point or spot light of a cluster that shines towards a
/// receiver of a group at all; as point_bound.
template <class T>
LC_FN T group_point_bound(const ReceiverGroup<T>& group, const ClusterBounds<T>& lights, T clamp_sq) {
  using lanes::max;
  using lanes::min;
  using lanes::select;
  const T clamped_sq = max(clamp_sq, T(kSmallestClamp * kSmallestClamp));
  const detail::VectorBox<T> to_lights = detail::lights_from(group, lights);
  const detail::VectorBox<T> from_lights = detail::reversed(to_lights);
  const T cos_axis = detail::cosine_bound(detail::extent_along(lights.axis, from_lights), from_lights);
  const detail::AxisExtent<T> seen = detail::extent_seen(group, to_lights);
  const T falloff = T(1) / max(to_lights.distance_min_sq, clamped_sq);
  const T together = detail::cosine_falloff_bound(seen, to_lights, clamped_sq) +
                     detail::tilt_of(group.cos_half_angle, group.sin_half_angle) * falloff;
  const T apart = falloff * detail::cosine_to_cone(detail::cosine_bound(seen, to_lights), group.cos_half_angle,
                                                   group.sin_half_angle);
  return select(cos_axis + T(2e-6f) >= lights.cos_half_angle, min(together, apart) * T(detail::kBoundFactor), T(0));
}

/// Largest cos+(receiver) of any directional light of a cluster at any receiver of a group; `lights` holds the box of
/// the unit vectors to the lights.
template <class T>
LC_FN T group_directional_bound(const ReceiverGroup<T>& group, const ClusterBounds<T>& lights) {
  using lanes::inverse_sqrt;
  using lanes::max;
  using lanes::min;
  using lanes::select;
  const detail::VectorBox<T> box = detail::vector_box<T>(lights.lo, lights.hi);
  const detail::AxisExtent<T> extent = detail::extent_along(group.axis, box);
  // The vectors themselves have length 1, whatever else is in the box.
  const T length_sq = max(T(1), extent.across_sq + extent.hi * extent.hi);
  const T towards = extent.hi * inverse_sqrt(length_sq);
  const T rounding = select(group.sin_half_angle > T(0), T(1e-6f), T(0));
  const T cos_axis = min(max(select(extent.hi > T(0), towards, extent.hi) + rounding, T(-1)), T(1));
  return min(detail::cosine_to_cone(cos_axis, group.cos_half_angle, group.sin_half_angle) * T(detail::kBoundFactor),
             T(1));
}

}  // namespace lightcuts
