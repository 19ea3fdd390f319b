#pragma once

#include <algorithm>
#include <cmath>

#include "lightcuts/lights.h"
#include "lightcuts/math.h"

namespace lightcuts::oracle {

// What one light does to one receiver, written again in double precision from the formulas of the literature; shares
// nothing with src/kernels/light.h.

struct Point {
  double x, y, z;
};
inline Point point(Vec3 v) { return {v.x, v.y, v.z}; }
inline Point minus(Point a, Point b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline double inner(Point a, Point b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Cosine between a normal and the way to a light, both normals having to see it.
inline double cos_receiver(Vec3 ns, Vec3 ng, Point to_light, double distance) {
  if (inner(point(ng), to_light) <= 0) return 0;
  return std::max(inner(point(ns), to_light) / distance, 0.0);
}

/// cos_y cos_x / max(d, d_c)^2 of an oriented light.
inline double vpl_factor(Vec3 position, Vec3 ns, Vec3 ng, Vec3 light, Vec3 axis, double min_distance) {
  const Point to_light = minus(point(light), point(position));
  const double distance = std::sqrt(inner(to_light, to_light));
  if (distance == 0) return 0;
  const double cos_light = std::max(-inner(point(axis), to_light) / distance, 0.0);
  const double clamped = std::max(distance, min_distance);
  return cos_receiver(ns, ng, to_light, distance) * cos_light / (clamped * clamped);
}

/// cos_y s^2 / d^2 of a point or spot light.
inline double point_factor(Vec3 position, Vec3 ns, Vec3 ng, const PointLight& light) {
  const Point to_light = minus(point(light.position), point(position));
  const double distance = std::sqrt(inner(to_light, to_light));
  if (distance == 0) return 0;
  double edge = 1;
  if (light.cos_outer > -1) {
    const double cosine = -inner(point(light.axis), to_light) / distance;
    const double t = (cosine - light.cos_outer) / (static_cast<double>(light.cos_inner) - light.cos_outer);
    edge = std::clamp(t, 0.0, 1.0);
  }
  return cos_receiver(ns, ng, to_light, distance) * edge * edge / (distance * distance);
}

/// cos_y of a directional light.
inline double directional_factor(Vec3 ns, Vec3 ng, Vec3 direction) {
  return cos_receiver(ns, ng, point(-direction), 1);
}

}  // namespace lightcuts::oracle
