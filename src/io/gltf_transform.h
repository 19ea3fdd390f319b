#pragma once

#include "io/gltf_json.h"
#include "lightcuts/math.h"

namespace lightcuts::gltf {

/// Affine map in double precision: long chains of nodes then lose nothing that a float shows.
struct Transform {
  Vec3T<double> x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin{0, 0, 0};
};

Transform operator*(const Transform& a, const Transform& b);

/// The same in single precision; what overflows becomes infinite.
Affine to_affine(const Transform& m);

/// Translation, rotation (a quaternion x y z w, normalised here; zero means none) and scale.
Transform make_transform(const float translation[3], const float rotation[4], const float scale[3]);

/// The `matrix`, or `translation`, `rotation` and `scale`, of a node. Throws Error{malformed}.
Transform read_transform(const JsonValue& node);

/// Unit axes at right angles with the same viewing direction and upper side: for cameras and lights, which do not scale.
/// Axes without length are replaced.
Affine without_scale(const Transform& m);

}  // namespace lightcuts::gltf
