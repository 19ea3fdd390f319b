#pragma once

#include <algorithm>
#include <cmath>

#include "oracle/cut_oracle.h"

namespace lightcuts::oracle {

/// The classic bound: largest receiver cosine, largest emitter cosine and smallest distance, each by itself; cosines by
/// the reference's equation (1.5) in a fixed frame. What the reference's worked example was counted with.
inline double classic_cosine(Vec3 axis, const double lo[3], const double hi[3]) {
  const Vec3 helper = std::abs(axis.x) < 0.9f ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 side = normalize(cross(axis, helper)), up = cross(axis, side);
  double least[3], most[3];
  const Vec3 frame[3] = {side, up, axis};
  for (int k = 0; k < 3; ++k) {
    least[k] = most[k] = 0;
    for (int i = 0; i < 3; ++i) {
      const double u = component(frame[k], i);
      least[k] += std::min(u * lo[i], u * hi[i]);
      most[k] += std::max(u * lo[i], u * hi[i]);
    }
  }
  double across_sq = 0;
  for (int k = 0; k < 2; ++k) {
    const bool ahead = most[2] >= 0;
    const double nearest = least[k] <= 0 && most[k] >= 0 ? 0 : std::min(std::abs(least[k]), std::abs(most[k]));
    const double used = ahead ? nearest : std::max(std::abs(least[k]), std::abs(most[k]));
    across_sq += used * used;
  }
  const double length = std::sqrt(across_sq + most[2] * most[2]);
  return length > 0 ? most[2] / length : 1;
}

inline double classic_bound(const CutPoint& point, const LightNode& node) {
  const DoublePoint y(point.position), b(node.box.lo), t(node.box.hi);
  const double lo[3] = {b.x - y.x, b.y - y.y, b.z - y.z}, hi[3] = {t.x - y.x, t.y - y.y, t.z - y.z};
  const double back_lo[3] = {-hi[0], -hi[1], -hi[2]}, back_hi[3] = {-lo[0], -lo[1], -lo[2]};
  double distance_sq = 0;
  for (int k = 0; k < 3; ++k) distance_sq += std::pow(std::max({lo[k], -hi[k], 0.0}), 2);
  const double receiver = std::max(classic_cosine(point.normal, lo, hi), 0.0);
  const double away = std::acos(std::clamp(classic_cosine(node.axis, back_lo, back_hi), -1.0, 1.0));
  const double half = std::acos(std::clamp(double(node.cos_half_angle), -1.0, 1.0));
  const double emitter = away <= half ? 1 : std::max(std::cos(away - half), 0.0);
  return receiver * emitter / std::max(distance_sq, point.clamp * point.clamp);
}

}  // namespace lightcuts::oracle
