#pragma once

#include <algorithm>
#include <cmath>

#include "lightcuts/lights.h"

namespace lightcuts::oracle {

/// What one light gives to a point without visibility, intensity and albedo, in double precision; written from the
/// definitions, apart from the renderer's kernels.
struct DoublePoint {
  double x, y, z;
  explicit DoublePoint(Vec3 v) : x(v.x), y(v.y), z(v.z) {}
};

/// cos+(receiver) cos+(emitter) / max(d^2, clamp^2); 0 for a light at the point itself.
inline double vpl_term(Vec3 position, Vec3 normal, Vec3 light, Vec3 axis, double clamp) {
  const DoublePoint y(position), n(normal), x(light), a(axis);
  const double vx = x.x - y.x, vy = x.y - y.y, vz = x.z - y.z;
  const double d_sq = vx * vx + vy * vy + vz * vz;
  if (!(d_sq > 0)) return 0;
  const double d = std::sqrt(d_sq);
  const double cos_y = (n.x * vx + n.y * vy + n.z * vz) / d, cos_x = -(a.x * vx + a.y * vy + a.z * vz) / d;
  return std::max(cos_y, 0.0) * std::max(cos_x, 0.0) / std::max(d_sq, clamp * clamp);
}

/// cos+(receiver) s^2 / max(d^2, clamp^2) with s the spot's factor.
inline double point_term(Vec3 position, Vec3 normal, const PointLight& light, double clamp) {
  const DoublePoint y(position), n(normal), x(light.position), a(light.axis);
  const double vx = x.x - y.x, vy = x.y - y.y, vz = x.z - y.z;
  const double d_sq = vx * vx + vy * vy + vz * vz;
  if (!(d_sq > 0)) return 0;
  const double d = std::sqrt(d_sq);
  const double cos_y = (n.x * vx + n.y * vy + n.z * vz) / d, cos_x = -(a.x * vx + a.y * vy + a.z * vz) / d;
  double s = 1;
  if (light.cos_outer >= -1) {
    const double inner = light.cos_inner, outer = light.cos_outer;
    s = std::clamp((cos_x - outer) / (inner - outer), 0.0, 1.0);
  }
  return std::max(cos_y, 0.0) * s * s / std::max(d_sq, clamp * clamp);
}

}  // namespace lightcuts::oracle
