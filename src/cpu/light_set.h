#pragma once

#include <span>
#include <vector>

#include "cpu/simd/packet.h"
#include "lightcuts/lights.h"

namespace lightcuts {

/// All lights of the sum as the inner loops read them; indices are those of Lights.
struct LightSet {
  std::span<const Vpl> vpls;  ///< those of the Lights that it was made of: millions need no second copy
  std::vector<PointRecord> points;
  std::vector<DirectionalRecord> directionals;
};

/// Lays the lights out for the inner loops.
///
/// Throws Error{invalid_scene} where a number of a light is not finite or a coordinate lies beyond 1e9 m: from here on
/// finite sums are taken for granted.
///
/// The VPLs stay where they are: `lights`, or what it was moved to, must outlive the set.
LightSet make_light_set(const Lights& lights);
LightSet make_light_set(Lights&& lights) = delete;

}  // namespace lightcuts
