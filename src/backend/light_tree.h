#pragma once

#include <cstdint>
#include <vector>

#include "lightcuts/math.h"

namespace lightcuts {

/// One cluster of a binary light tree.
///
/// `box` bounds the positions of its lights (for directional lights: their unit directions towards the light);
/// `axis` and `cos_half_angle` bound their emission axes: dot(axis, n) >= cos_half_angle for every axis n below.
struct LightNode {
  Box box;
  Vec3 axis{0, 0, 1};
  float cos_half_angle = -1;
  Vec3 intensity;                 ///< sum over the lights below
  std::uint32_t representative;   ///< index of the light that stands for the cluster
  std::uint32_t left, right;      ///< children, the one that carries the representative first; kNone for a leaf
  std::uint32_t leaf_count;       ///< lights below
};

/// Tree over one kind of light. Children stand behind their parents; the root is node 0; 2 n - 1 nodes; empty if n = 0.
struct LightTree {
  std::vector<LightNode> nodes;
  std::uint32_t depth = 0;  ///< longest path, a single leaf counting 1
};

/// One tree for each kind of light, since their bounds differ; a cut starts with their roots.
struct LightTrees {
  LightTree vpls, points, directionals;
};

}  // namespace lightcuts
