#pragma once

#include "lightcuts/math.h"

namespace lightcuts {

/// Triangles are safe to leave at this many units of rounding of the largest term that made their corners. The
/// interpolated point, the transform and the robust intersection each lose a few; 32 is twice what tests needed.
inline constexpr float kSafeUlps = 32 * 5.9604645e-8f;

LC_FN Vec3 absolute(Vec3 v) { return {v.x < 0 ? -v.x : v.x, v.y < 0 ? -v.y : v.y, v.z < 0 ? -v.z : v.z}; }

/// Moves a point off a surface to the side of `ng`, by units of rounding of its largest coordinate.
/// For points that are no Surface::position, which has been moved already; moving twice does no harm.
LC_FN Vec3 offset_point(Vec3 p, Vec3 ng) { return p + ng * (max_component(absolute(p)) * kSafeUlps + 1e-30f); }

}  // namespace lightcuts
