#pragma once

#include "backend/light_tree.h"
#include "lightcuts/lights.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// Builds one light tree for each kind of light.
///
/// @param scene_diagonal  of the scene's box [m], > 0: Walter's c and the study's alpha_S
/// TreeBuilder::agglomerative is exactly the greedy result up to 32768 lights of a kind; of more, the lowest levels come
/// from locally ordered rounds. The result depends on lights, diagonal and options alone, not on threads. An empty result where progress asked to stop.
/// Throws Error{out_of_memory} before it starts, naming what it needs, and Error{invalid_argument} for more lights than
/// nodes can index.
LightTrees build_light_trees(const Lights& lights, float scene_diagonal, const TreeOptions& options,
                             const ProgressFn& progress = {});

/// Most that building a tree over `light_count` lights holds at once, the tree included, the lights not [bytes].
std::uint64_t light_tree_build_bytes(std::uint64_t light_count, TreeBuilder builder);

}  // namespace lightcuts
