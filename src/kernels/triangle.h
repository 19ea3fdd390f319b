#pragma once

#include "lightcuts/math.h"

namespace lightcuts {

/// What of a ray the watertight triangle test needs, computed once a ray.
///
/// The ray is sheared so that it points along +z of permuted axes: then neighbours that share an edge evaluate the very
/// same edge function, and no ray slips between them.
/// Source: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection".
struct ShearedRay {
  Vec3 direction;
  Vec3 x, y;  ///< what a corner's coordinates weigh in its sheared ones: 1, 0 and the shear of the permuted axes
};

LC_FN ShearedRay shear(Vec3 direction) {
  const float ax = direction.x < 0 ? -direction.x : direction.x;
  const float ay = direction.y < 0 ? -direction.y : direction.y;
  const float az = direction.z < 0 ? -direction.z : direction.z;
  const int kz = ax > ay ? (ax > az ? 0 : 2) : (ay > az ? 1 : 2);
  const float scale = -1.0f / component(direction, kz);
  const Vec3 n = direction * scale;
  const Vec3 first = kz == 0 ? Vec3{n.y, 1, 0} : kz == 1 ? Vec3{0, n.z, 1} : Vec3{1, 0, n.x};
  const Vec3 second = kz == 0 ? Vec3{n.z, 0, 1} : kz == 1 ? Vec3{1, n.x, 0} : Vec3{0, 1, n.y};
  return scale > 0 ? ShearedRay{direction, second, first} : ShearedRay{direction, first, second};
}

/// a b - c d with both products rounded: never fused, so that swapping the pairs only flips the sign. With a fused
/// multiply-add two neighbours would disagree about their common edge.
LC_FN float product_difference(float a, float b, float c, float d) {
#if defined(__CUDA_ARCH__)
  return __fsub_rn(__fmul_rn(a, b), __fmul_rn(c, d));
#else
  return a * b - c * d;
#endif
}

/// a b + c rounded once where that is one operation, whatever the compiler is told.
LC_FN float multiply_add(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
  return __fmaf_rn(a, b, c);
#else
  return a * b + c;
#endif
}

/// One sheared coordinate of a corner, by the same operations wherever it is asked for: neighbours must agree about their
/// common corners.
LC_FN float sheared(Vec3 corner, Vec3 weights) {
#if defined(__CUDA_ARCH__)
  const float x = __fmul_rn(corner.x, weights.x);
#else
  const float x = corner.x * weights.x;
#endif
  return multiply_add(corner.z, weights.z, multiply_add(corner.y, weights.y, x));
}

/// Normal of a triangle by its edges in a row: of three products that are equal but for rounding, that of the two
/// shorter edges, as long thin triangles' other ones are all cancellation.
LC_FN Vec3 plane_normal(Vec3 ab, Vec3 bc, Vec3 ca) {
  const float ab_sq = length_sq(ab), bc_sq = length_sq(bc), ca_sq = length_sq(ca);
  const bool ab_longest = ab_sq >= bc_sq && ab_sq >= ca_sq, bc_longest = bc_sq >= ca_sq;
  const Vec3 first = ab_longest ? bc : bc_longest ? ca : ab, second = ab_longest ? ca : bc_longest ? ab : bc;
  return cross(first, second);
}

/// Distance and barycentric coordinates (weights of corners 1 and 2) of a hit; t < 0: none.
struct TriangleHit {
  float t, u, v;
};

/// Distance of a hit, t < 0: none; and what its barycentric coordinates come from, where they are wanted.
struct TriangleMeeting {
  float t, e1, e2, det;
  LC_FN TriangleHit hit() const {
    const float inv_det = 1.0f / det;
    return {t, e1 * inv_det, e2 * inv_det};
  }
};

/// Meets a triangle from either side within [t_min, t_max]; both ends count.
LC_FN TriangleMeeting meet_triangle(Vec3 origin, const ShearedRay& ray, Vec3 p0, Vec3 p1, Vec3 p2, float t_min,
                                    float t_max) {
  const TriangleMeeting miss{-1, 0, 0, 1};
  const Vec3 a = p0 - origin, b = p1 - origin, c = p2 - origin;
  const float ax = sheared(a, ray.x), ay = sheared(a, ray.y);
  const float bx = sheared(b, ray.x), by = sheared(b, ray.y);
  const float cx = sheared(c, ray.x), cy = sheared(c, ray.y);
  float e0 = product_difference(cx, by, cy, bx);
  float e1 = product_difference(ax, cy, ay, cx);
  float e2 = product_difference(bx, ay, by, ax);
  // On an edge float cannot tell the side; double can, and both neighbours then agree.
  if (e0 == 0 || e1 == 0 || e2 == 0) {
    e0 = static_cast<float>(static_cast<double>(cx) * by - static_cast<double>(cy) * bx);
    e1 = static_cast<float>(static_cast<double>(ax) * cy - static_cast<double>(ay) * cx);
    e2 = static_cast<float>(static_cast<double>(bx) * ay - static_cast<double>(by) * ax);
  }
  if ((e0 < 0 || e1 < 0 || e2 < 0) && (e0 > 0 || e1 > 0 || e2 > 0)) return miss;
  const float det = e0 + e1 + e2;
  if (det == 0) return miss;
  // Whether it hits is decided; where, the plane tells better: edge functions of a triangle seen at a grazing angle are
  // all cancellation, its edges are not.
  const Vec3 normal = plane_normal(p1 - p0, p2 - p1, p0 - p2);
  const float t = dot(a, normal) / dot(ray.direction, normal);
  if (!(t >= t_min && t <= t_max)) return miss;
  return {t, e1, e2, det};
}

LC_FN TriangleHit intersect_triangle(Vec3 origin, const ShearedRay& ray, Vec3 p0, Vec3 p1, Vec3 p2, float t_min,
                                     float t_max) {
  return meet_triangle(origin, ray, p0, p1, p2, t_min, t_max).hit();
}

}  // namespace lightcuts
