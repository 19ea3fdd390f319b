#pragma once

#include <vector>

#include "cpu/simd/packet.h"
#include "lightcuts/lights.h"

namespace lightcuts {

/// All lights of the sum as the inner loops read them; indices are those of Lights.
struct LightSet {
  std::vector<VplRecord> vpls;
  std::vector<PointRecord> points;
  std::vector<DirectionalRecord> directionals;
};

/// Lays the lights out for the inner loops.
///
/// Throws Error{invalid_scene} where a number of a light is not finite or a coordinate lies beyond 1e9 m: from here on
/// finite sums are taken for granted.
LightSet make_light_set(const Lights& lights);

}  // namespace lightcuts
