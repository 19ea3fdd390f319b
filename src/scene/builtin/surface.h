#pragma once

#include <vector>

#include "lightcuts/scene.h"

// Helpers that build meshes with shading normals and texture coordinates; texture coordinates count metres unless said
// otherwise, so that a texture keeps its size on every piece of furniture.

namespace lightcuts {

/// Turns a profile of points (radius, height), listed so that its outside is on the right hand (from the bottom up for
/// a vase), about the vertical axis through `center`. Corners sharper than 40 degrees stay sharp.
void add_lathe(Mesh& mesh, const std::vector<Vec2>& profile, int segments, Vec3 center);

}  // namespace lightcuts
