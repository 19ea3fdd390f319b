#pragma once

#include "lightcuts/math.h"

namespace lightcuts {

/// Right-handed orthonormal frame: z is the unit vector it was made of.
struct Frame {
  Vec3 x, y, z;
};

/// Frame around the unit vector `n`, without a branch or a normalisation; cross(x, y) = z.
/// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
LC_FN Frame make_frame(Vec3 n) {
  const float sign = n.z < 0 ? -1.0f : 1.0f;
  const float a = -1.0f / (sign + n.z);
  const float q = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * q, -sign * n.x}, {q, sign + n.y * n.y * a, -n.y}, n};
}

/// From the frame's coordinates to the space its axes are written in.
LC_FN Vec3 to_world(const Frame& f, Vec3 v) { return f.x * v.x + f.y * v.y + f.z * v.z; }

}  // namespace lightcuts
