#pragma once

#include <array>
#include <string>

#include "lightcuts/scene.h"

// Helpers that build flat-shaded meshes.

namespace lightcuts {

/// A four-sided face, counter-clockwise seen from its front. Its corners are not shared, so that it stays flat.
void add_quad(Mesh& mesh, Vec3 a, Vec3 b, Vec3 c, Vec3 d);

/// A horizontal ring, facing down, between a rectangle and a rectangle inside it: a ceiling around a lamp. Both run
/// counter-clockwise seen from below, corner i of one next to corner i of the other.
void add_ring(Mesh& mesh, const std::array<Vec3, 4>& outer, const std::array<Vec3, 4>& inner);

/// The six faces of a hexahedron, seen from outside. Corner i has the low or high x, y, z of the bits 0, 1, 2 of i.
void add_hexahedron(Mesh& mesh, const std::array<Vec3, 8>& corners);

/// An axis-aligned box seen from outside.
void add_box(Mesh& mesh, Box box);

/// The same seen from inside: a closed room, without the sides named in `open` ("-x", "+y", ...).
void add_room(Mesh& mesh, Box box, const std::string& open = "");

/// Adds a diffuse material and returns its index.
std::uint32_t add_material(Scene& scene, const std::string& name, Vec3 albedo, Vec3 emission = {});

/// Adds a mesh with a material and draws it once where it is.
void add_mesh(Scene& scene, Mesh mesh, const std::string& name, std::uint32_t material);

}  // namespace lightcuts
