#pragma once

#include <cstdint>
#include <vector>

#include "kernels/scene_view.h"

namespace lightcuts {

/// Rays from random surface points, triangles being equally likely, in random directions: as incoherent as shadow rays
/// and light paths can be. For tests and benchmarks. The scene must have a triangle.
std::vector<Ray> surface_rays(const SceneView& scene, std::uint32_t count, std::uint64_t seed);

}  // namespace lightcuts
