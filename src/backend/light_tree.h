#pragma once

#include <cstdint>
#include <vector>

#include "lightcuts/math.h"
#include "lightcuts/scene.h"

namespace lightcuts {

/// One cluster of a binary light tree: 64 bytes, one cache line, so that a refinement reads one aligned pair.
///
/// `box` bounds the positions of its lights (of directional lights: the unit directions towards them).
/// The cone bounds, for VPLs, the emission axes n: dot(axis, n) >= cos_half_angle, or n == axis where it is 1; for
/// points and spots it bounds every direction into which a light shines (-1: all of them); directionals leave it open.
struct alignas(64) LightNode {
  Box box;
  Vec3 axis{0, 0, 1};
  float cos_half_angle = -1;
  Vec3 intensity;                    ///< sum over the lights below
  std::uint32_t representative = 0;  ///< index of the light that stands for the cluster
  /// Index of the child that carries the representative; the other child is the next node. kNone for a leaf.
  std::uint32_t first_child = kNone;
  std::uint32_t leaf_count = 1;  ///< lights below

  [[nodiscard]] LC_FN bool is_leaf() const { return first_child == kNone; }
  [[nodiscard]] LC_FN std::uint32_t second_child() const { return first_child + 1; }
};
static_assert(sizeof(LightNode) == 64);

/// Tree over one kind of light; 2 n - 1 nodes, empty if n = 0; the root is node 0.
///
/// Siblings stand side by side and behind their parent. A node's descendants fill one block of 2 (leaf_count - 1) nodes
/// that starts with its children; of two siblings, the block of the one with fewer leaves comes first, which is the
/// order in which a walk with a small stack visits them.
struct LightTree {
  std::vector<LightNode> nodes;
  std::uint32_t depth = 0;  ///< longest path, a single leaf counting 1
};

/// One tree for each kind of light, since their bounds differ; a cut starts with their roots.
struct LightTrees {
  LightTree vpls, points, directionals;
};

}  // namespace lightcuts
