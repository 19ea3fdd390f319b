#pragma once

#include <functional>
#include <vector>

#include "lightcuts/scene.h"

// Helpers that build meshes with shading normals and texture coordinates. Texture coordinates count metres, so that a
// texture keeps its size on every piece of furniture. Do not mix with shapes.h in one mesh: those have no normals.

namespace lightcuts {

/// Turns a profile of points (radius, height), listed so that its outside is on the right hand (from the bottom up for
/// a vase), about the vertical axis through `center`. Corners sharper than 40 degrees stay sharp.
void add_lathe(Mesh& mesh, const std::vector<Vec2>& profile, int segments, Vec3 center);

/// A ball around `center`.
void add_ball(Mesh& mesh, Vec3 center, float radius, int segments);

/// A rectangle from `corner` along two edges; its front is where cross(along_u, along_v) points. One quad.
void add_panel(Mesh& mesh, Vec3 corner, Vec3 along_u, Vec3 along_v);

/// A box with sharp edges.
void add_sharp_box(Mesh& mesh, Box box);

/// A box whose edges and corners are rounded with `radius` in 2 * `segments` strips.
void add_rounded_box(Mesh& mesh, Box box, float radius, int segments);

/// A curved patch of nu x nv quads: the image of the unit square. Its front is where cross(d/du, d/dv) points.
/// `texture_size` scales the unit square to texture coordinates.
void add_patch(Mesh& mesh, int nu, int nv, const std::function<Vec3(float u, float v)>& surface, Vec2 texture_size);

/// A closed tube of elliptic section along a curve: `radius` gives, at each u, the half axes along `binormal` (y) and
/// across it (x). The curve must not run along `binormal`.
void add_tube(Mesh& mesh, int nu, int nv, const std::function<Vec3(float u)>& curve,
              const std::function<Vec2(float u)>& radius, Vec3 binormal);

/// Adds a mapped copy of `part`.
void append(Mesh& mesh, const Mesh& part, const Affine& mesh_from_part);

/// Turned about the vertical axis by an angle [degrees], then moved.
Affine turned(float angle_deg, Vec3 origin);

}  // namespace lightcuts
