#pragma once

#include <string>

#include "lightcuts/scene.h"

// Helpers that the files of src/scene share.

namespace lightcuts {

/// Largest coordinate of a mesh or of the world [m]. The square of a triangle's doubled area must be a finite float:
/// (4e18)^2 is, (4e20)^2 is not. A scene of a million kilometres is a mistake of units or of a file.
inline constexpr float kLargestCoordinate = 1e9f;
/// Farthest place of a camera [m]: well outside the largest scene, and where rays still have a direction that holds.
inline constexpr float kFarthestEye = 1e12f;
/// Largest radiance, radiant intensity or irradiance: its square is a finite float with room for sums.
inline constexpr float kLargestRadiance = 1e15f;
/// Largest texture coordinate: beyond, a float no longer resolves a texel.
inline constexpr float kLargestTexcoord = 1e6f;

/// Box around the corners of a mesh's triangles, mapped by `world_from_object`. Indices must be valid.
Box mesh_bounds(const Mesh& mesh, const Affine& world_from_object);

/// Box around the mapped corners of a box that is not empty.
Box transform_box(const Affine& world_from_object, Box box);

/// Whether rays can start there: finite and not beyond kFarthestEye.
bool is_eye(Vec3 place);

/// "mesh 3 "chair"" or, without a name, "mesh 3": how messages name a thing.
std::string label(const char* kind, std::size_t index, const std::string& name);

/// "1 triangle", "7 triangles".
std::string counted(std::uint64_t count, const char* noun);

/// Checks and repairs one mesh; adds a sentence to `warnings` for what was repaired.
/// Throws Error{invalid_scene} for counts and indices that contradict each other.
void validate_mesh(Mesh& mesh, std::size_t index, std::vector<std::string>& warnings);

}  // namespace lightcuts
