#pragma once

#include "lightcuts/math.h"

namespace lightcuts {

/// Virtual point light: a cosine lobe on one side of a surface. Area-light samples are of the same kind.
/// Radiant intensity I(w) = intensity * max(dot(axis, w), 0).
struct Vpl {
  Vec3 position;   ///< [m], world space
  Vec3 axis;       ///< unit normal of the emitting side
  Vec3 intensity;  ///< along the axis [W/sr]
};

}  // namespace lightcuts
