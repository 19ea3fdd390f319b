#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "backend/light_tree.h"
#include "lightcuts/lights.h"

namespace lightcuts::test {

/// What a node must agree with, gathered from the lights below it.
struct Below {
  std::vector<std::uint32_t> lights;
  double sum[3] = {0, 0, 0};
};

inline bool contains(const Box& outer, const Box& inner) {
  return outer.lo.x <= inner.lo.x && outer.lo.y <= inner.lo.y && outer.lo.z <= inner.lo.z && outer.hi.x >= inner.hi.x &&
         outer.hi.y >= inner.hi.y && outer.hi.z >= inner.hi.z;
}

/// Every promise of light_tree.h, checked node by node.
inline void expect_valid(const LightTree& tree, const std::vector<Vpl>& lights) {
  ASSERT_EQ(tree.nodes.size(), 2 * lights.size() - 1);
  std::vector<Below> below(tree.nodes.size());
  std::vector<std::uint32_t> height(tree.nodes.size(), 1), seen(lights.size(), 0), parents(tree.nodes.size(), 0);
  for (std::uint32_t i = static_cast<std::uint32_t>(tree.nodes.size()); i-- > 0;) {
    const LightNode& node = tree.nodes[i];
    Below& own = below[i];
    ASSERT_LT(node.representative, lights.size());
    if (node.is_leaf()) {
      const Vpl& light = lights[node.representative];
      ++seen[node.representative];
      own.lights = {node.representative};
      own.sum[0] = light.intensity.x, own.sum[1] = light.intensity.y, own.sum[2] = light.intensity.z;
      ASSERT_TRUE(node.box.lo == light.position && node.box.hi == light.position && node.axis == light.axis);
      ASSERT_EQ(node.cos_half_angle, 1.0f);
    } else {
      ASSERT_GT(node.first_child, i);
      ASSERT_LT(node.second_child(), tree.nodes.size());
      for (const std::uint32_t child : {node.first_child, node.second_child()}) {
        ++parents[child];
        ASSERT_TRUE(contains(node.box, tree.nodes[child].box));
        own.lights.insert(own.lights.end(), below[child].lights.begin(), below[child].lights.end());
        for (int k = 0; k < 3; ++k) own.sum[k] += below[child].sum[k];
        height[i] = std::max(height[i], height[child] + 1);
        below[child].lights.clear();
        below[child].lights.shrink_to_fit();
      }
      ASSERT_EQ(node.representative, tree.nodes[node.first_child].representative);
      for (std::size_t k = 0; k < own.lights.size(); k += 1 + own.lights.size() / 64) {
        const Vec3 a = node.axis, n = lights[own.lights[k]].axis;
        const double cosine = double(a.x) * n.x + double(a.y) * n.y + double(a.z) * n.z;
        ASSERT_TRUE(a == n || cosine >= double(node.cos_half_angle)) << "node " << i;
      }
    }
    ASSERT_EQ(node.leaf_count, own.lights.size());
    ASSERT_NEAR(node.intensity.x, own.sum[0], 1e-5 * own.sum[0]);
    ASSERT_NEAR(node.intensity.y, own.sum[1], 1e-5 * own.sum[1]);
    ASSERT_NEAR(node.intensity.z, own.sum[2], 1e-5 * own.sum[2]);
  }
  EXPECT_EQ(height[0], tree.depth);
  for (const std::uint32_t count : seen) ASSERT_EQ(count, 1u);
  for (std::size_t i = 1; i < parents.size(); ++i) ASSERT_EQ(parents[i], 1u);
}

}  // namespace lightcuts::test
