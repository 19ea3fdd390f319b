#pragma once

#include <cstddef>
#include <vector>

#include "kernels/occluder.h"
#include "kernels/scene_view.h"

namespace lightcuts {

/// The largest convex polygons that the scene's opaque triangles make, by area, largest first.
///
/// Neighbours in one plane that share an edge, corner for corner, are merged while the result is convex and has at most
/// four corners. Triangles with an alpha mask are left out. Deterministic; linear in the number of triangles.
std::vector<Occluder> find_occluders(const SceneView& scene, std::size_t most);

}  // namespace lightcuts
