#pragma once

#include <vector>

#include "lightcuts/lights.h"
#include "oracle/brute_force.h"

// An oracle for the sum over VPLs: naive, unshadowed, unclamped, in double precision.

namespace lightcuts::oracle {

/// Irradiance at `at` with unit normal `n`, green channel [W/m^2].
inline double irradiance(const std::vector<Vpl>& vpls, Vec3 at, Vec3 n) {
  double sum = 0;
  for (const Vpl& v : vpls) {
    const D3 d = wide(v.position) - wide(at);
    const double distance_sq = inner(d, d), distance = std::sqrt(distance_sq);
    const double cos_y = inner(d, wide(n)) / distance, cos_x = -inner(d, wide(v.axis)) / distance;
    if (cos_x > 0 && cos_y > 0) sum += v.intensity.y * cos_x * cos_y / distance_sq;
  }
  return sum;
}

}  // namespace lightcuts::oracle
