#pragma once

#include <cstdint>

#include "kernels/offset_point.h"
#include "lightcuts/math.h"

/// What a polygon of the scene hides for certain: the lights of a cluster from every point of a group of receivers.
///
/// Seen from a box of receivers, a convex polygon has an umbra behind it: the points that none of the receivers sees. It
/// is the intersection of half-spaces: one behind the polygon's plane, and for each edge one whose plane touches the edge
/// and the box. A cluster whose box lies in the umbra sends nothing to the group, so its contribution and its error are
/// exactly 0, and no ray has to say so. Source: Coorg and Teller 1997; Hudson et al. 1997, with a box instead of an eye.
namespace lightcuts {

inline constexpr int kMostOccluders = 256;  ///< of a scene
inline constexpr int kOccluderCorners = 4;
inline constexpr int kUmbraPlanes = kOccluderCorners + 1;

/// A convex polygon that no light passes, from either side. A triangle has its last corner twice.
struct Occluder {
  Vec3 corner[kOccluderCorners];  ///< in order [m]
  Vec3 inward[kOccluderCorners];  ///< unit, in the plane, across the edge from corner i to the next
  Vec3 normal;                    ///< unit
  float area;                     ///< [m^2]
};

/// Where dot(normal, p) + offset is positive.
struct HalfSpace {
  Vec3 normal;
  float offset;
};

/// Points that no receiver of a group sees, as an intersection. The last half-space is the one behind the polygon's plane:
/// most boxes are not in it, so it is asked first.
struct Umbra {
  HalfSpace behind[kUmbraPlanes];
};

/// How far rounding may move ends of rays and corners of triangles in a scene whose coordinates are at most `largest` [m].
LC_FN float occluder_rounding(float largest) { return kSafeUlps * largest + 1e-30f; }

namespace detail {

LC_FN Vec3 box_corner(const Box& box, int i) {
  return {(i & 1) != 0 ? box.hi.x : box.lo.x, (i & 2) != 0 ? box.hi.y : box.lo.y, (i & 4) != 0 ? box.hi.z : box.lo.z};
}

/// Corner of the box that is farthest against a direction.
LC_FN Vec3 box_support(const Box& box, Vec3 direction) {
  return {direction.x > 0 ? box.lo.x : box.hi.x, direction.y > 0 ? box.lo.y : box.hi.y,
          direction.z > 0 ? box.lo.z : box.hi.z};
}

}  // namespace detail

/// Finds the umbra of a polygon as seen from a box of receivers; false where the box is not wholly on one side of it.
///
/// @param rounding  as from occluder_rounding: ends of rays and corners of the polygon may be off by it
/// @param gap       blockers that are nearer than this to a light are not counted: its ray may end before them [m]
///
/// With a = distance of a receiver r before the plane, s = dot(inward, r - corner) / a, the line through r and the edge goes
/// on by -s for each unit behind the plane: the smallest s of all receivers bounds the umbra. It is a quotient of linear
/// functions, so a corner of the box has it.
LC_KERNEL bool find_umbra(const Occluder& occluder, const Box& receivers, float rounding, float gap, Umbra& umbra) {
  const Vec3 at = occluder.corner[0];
  Vec3 back = occluder.normal;
  if (dot(back, detail::box_support(receivers, -back) - at) > -rounding) back = -back;
  if (!(dot(back, detail::box_support(receivers, -back) - at) < -2 * rounding)) return false;
  umbra.behind[kOccluderCorners] = {back, -dot(back, at) - gap - 2 * rounding};
#if defined(__CUDA_ARCH__)
#pragma unroll 1
#endif
  for (int edge = 0; edge < kOccluderCorners; ++edge) {
    const Vec3 inward = occluder.inward[edge], corner = occluder.corner[edge];
    float slope = kInfinity;
    for (int i = 0; i < 8; ++i) {
      const Vec3 to = detail::box_corner(receivers, i) - corner;
      const float inside = dot(inward, to) - 2 * rounding, before = -dot(back, to);
      slope = min_of(slope, inside / (inside > 0 ? before + rounding : before - rounding));
    }
    // Inside where dot(inward, p - corner) + slope * dot(back, p - corner) > 0.
    const Vec3 across = inward + back * slope;
    const Vec3 normal = across / std::sqrt(1 + slope * slope);
    umbra.behind[edge] = {normal, -dot(normal, corner) - 2 * rounding};
  }
  return true;
}

/// True where no receiver sees any point of the box.
LC_FN bool hides_box(const Umbra& umbra, const Box& box) {
  for (int i = kUmbraPlanes - 1; i >= 0; --i) {
    const HalfSpace& h = umbra.behind[i];
    if (!(dot(h.normal, detail::box_support(box, h.normal)) + h.offset > 0)) return false;
  }
  return true;
}

/// Sine of the angle that directions must be inside an umbra by, against rounding.
inline constexpr float kUmbraDirectionSlack = 4e-6f;

/// True where no receiver sees anything in any direction of a box of directions of about unit length.
LC_FN bool hides_directions(const Umbra& umbra, const Box& directions) {
  for (int i = kUmbraPlanes - 1; i >= 0; --i) {
    const Vec3 normal = umbra.behind[i].normal;
    if (!(dot(normal, detail::box_support(directions, normal)) > kUmbraDirectionSlack)) return false;
  }
  return true;
}

/// False where an umbra has no point of the box for certain.
LC_FN bool touches_box(const Umbra& umbra, const Box& box) {
  for (int i = kUmbraPlanes - 1; i >= 0; --i) {
    const HalfSpace& h = umbra.behind[i];
    if (!(dot(h.normal, detail::box_support(box, -h.normal)) + h.offset > 0)) return false;
  }
  return true;
}

/// True where the receivers are on one side of the polygon's plane and some of the lights' box is on the other.
LC_FN bool is_between(const Occluder& occluder, const Box& receivers, const Box& lights, float gap) {
  const Vec3 normal = occluder.normal, at = occluder.corner[0];
  const float receivers_lo = dot(normal, detail::box_support(receivers, normal) - at);
  const float receivers_hi = dot(normal, detail::box_support(receivers, -normal) - at);
  if (receivers_hi < 0) return dot(normal, detail::box_support(lights, -normal) - at) > gap;
  return receivers_lo > 0 && dot(normal, detail::box_support(lights, normal) - at) < -gap;
}

/// About how much of the sky of a group of receivers a polygon covers, were it a point: those that cover most are worth
/// having their umbras found.
LC_FN float occluder_weight(const Occluder& occluder, Vec3 receiver) {
  const Vec3 middle = (occluder.corner[0] + occluder.corner[1] + occluder.corner[2] + occluder.corner[3]) * 0.25f;
  const Vec3 to = middle - receiver;
  const float distance_sq = max_of(length_sq(to), 1e-20f);
  const float facing = dot(occluder.normal, to);
  // area * cosine / distance^2 squared: no root.
  return occluder.area * occluder.area * facing * facing / (distance_sq * distance_sq * distance_sq);
}

/// What an occluder must weigh (occluder_weight) to be worth its umbra where lights are looked up in shadow maps: a look costs
/// about as much as the few tests that each umbra adds. Measured on both processors (docs/results/ism.md, gpu.md).
inline constexpr float kLeastOccluderByMaps = 0.03f;

/// The occluders of a scene, and what rays' rounding asks for.
struct OccluderView {
  const Occluder* occluders = nullptr;
  std::uint32_t count = 0;
  float rounding = 0;  ///< as find_umbra wants it [m]
  float gap = 0;       ///< the same
};

/// @param bounds  of everything that rays go between
LC_FN OccluderView occluder_view(const Occluder* occluders, std::uint32_t count, const Box& bounds) {
  const float largest = max_of(max_component(absolute(bounds.lo)), max_component(absolute(bounds.hi)));
  // Twice the share of a ray's length that some shadow rays end before the light: kShadowRayEnd.
  return {occluders, count, occluder_rounding(largest), 2e-5f * length(bounds.hi - bounds.lo)};
}

}  // namespace lightcuts
