#pragma once

#include <cstdint>

#include "backend/light_tree.h"
#include "kernels/light_cluster.h"
#include "lightcuts/lights.h"

namespace lightcuts {

// The nodes of a light tree under construction by build_light_tree.h, and how two become one.

/// What all lights have in common.
struct LightSummary {
  Box bounds;           ///< of positions, or of unit directions towards directional lights
  float brightest = 0;  ///< luminance

  /// Darkest light of a metric: dark lights too are clustered by place. It changes no sum.
  [[nodiscard]] LC_FN float luminance_floor() const {
    return brightest > 0 ? max_of(brightest * 1e-20f, 1e-30f) : 1.0f;
  }
};

LC_FN LightNode leaf_of(const Vpl& light, std::uint32_t index) {
  return {{light.position, light.position}, light.axis, 1, light.intensity, index, kNone, 1};
}
LC_FN LightNode leaf_of(const PointLight& light, std::uint32_t index) {
  const bool spot = light.cos_outer >= -1;
  return {{light.position, light.position},
          spot ? light.axis : Vec3{0, 0, 1},
          spot ? light.cos_outer : -1.0f,
          light.intensity,
          index,
          kNone,
          1};
}
LC_FN LightNode leaf_of(const DirectionalLight& light, std::uint32_t index) {
  const Vec3 towards = -light.direction;
  return {{towards, towards}, Vec3{0, 0, 1}, -1, light.irradiance, index, kNone, 1};
}

namespace detail {

/// What a node under construction has beside what cuts need. 24 bytes.
struct NodeMaking {
  Vec3 rest;  ///< what rounding took from the summed intensity: long chains stay exact
  std::uint32_t smallest_light, largest_light;
  std::uint32_t height;  ///< a leaf: 1
};

/// Where a merged node that has a parent hangs: its descendants start `step` places behind where its parent's do.
struct NodeParent {
  std::uint32_t id, step;
};

/// The children of a merged node, the one that carries the representative first.
struct NodeChildren {
  std::uint32_t first, second;
};

/// Where two nodes' lights are and shine.
struct MergedShape {
  Box box;
  DirectionCone cone;
};

/// What else two nodes are as one.
struct MergedSums {
  Vec3 intensity;
  NodeMaking making;
  std::uint32_t representative, leaf_count;
  NodeChildren children;
  std::uint32_t first_leaves;  ///< of the first child
  bool first_block_first;      ///< of the children's blocks
};

/// A finished tree's root.
struct TreeRoot {
  std::uint32_t id, height;
};

/// Nodes by id: leaves 0 to n - 1 in the order of the curve, then the merged ones (light_tree_tiles.h says which is which).
struct NodesMaking {
  LightNode* nodes;
  NodeMaking* more;        ///< of merged node k; a leaf's follows from its node
  NodeParent* parents;     ///< of merged node k
  NodeChildren* children;  ///< of merged node k
  MetricScale scale;
  const LightSummary* summary;
  std::uint64_t seed;
  std::uint32_t leaf_count;

  [[nodiscard]] LC_KERNEL LightCluster cluster(const LightNode& n) const {
    const bool colored = scale.metric == Metric::distance_color || scale.metric == Metric::distance_color_direction;
    return {n.box,
            {n.axis, n.cos_half_angle},
            n.intensity,
            colored ? chromaticity(n.intensity) : Chromaticity{},
            luminance_of(n.intensity)};
  }

  [[nodiscard]] LC_KERNEL float luminance_of(const Vec3& intensity) const {
    return max_of(luminance(intensity), summary->luminance_floor());
  }

  [[nodiscard]] LC_KERNEL NodeMaking making_of(std::uint32_t id, const LightNode& node) const {
    if (id >= leaf_count) return more[id - leaf_count];
    return {{}, node.representative, node.representative, 1};
  }

  LC_KERNEL static void add_exactly(float& sum, float& rest, float sum_p, float rest_p, float sum_q, float rest_q) {
    const double exact = (static_cast<double>(sum_p) + rest_p) + (static_cast<double>(sum_q) + rest_q);
    sum = static_cast<float>(exact);
    rest = static_cast<float>(exact - sum);
  }

  [[nodiscard]] LC_KERNEL static MergedShape merge_shapes(const Box& p_box, const DirectionCone& p_cone,
                                                          const Box& q_box, const DirectionCone& q_cone) {
    return {extend(p_box, q_box), unite(p_cone, q_cone)};
  }

  /// p and q as one, p being the lower one in the array; of the nodes only sums, representatives and counts are asked.
  [[nodiscard]] LC_KERNEL MergedSums merge_sums(std::uint32_t p_id, const LightNode& p, const NodeMaking& mp,
                                                std::uint32_t q_id, const LightNode& q, const NodeMaking& mq) const {
    MergedSums merged;
    NodeMaking& making = merged.making;
    add_exactly(merged.intensity.x, making.rest.x, p.intensity.x, mp.rest.x, q.intensity.x, mq.rest.x);
    add_exactly(merged.intensity.y, making.rest.y, p.intensity.y, mp.rest.y, q.intensity.y, mq.rest.y);
    add_exactly(merged.intensity.z, making.rest.z, p.intensity.z, mp.rest.z, q.intensity.z, mq.rest.z);
    making.smallest_light = min_of(mp.smallest_light, mq.smallest_light);
    making.largest_light = max_of(mp.largest_light, mq.largest_light);
    making.height = 1 + max_of(mp.height, mq.height);
    merged.leaf_count = p.leaf_count + q.leaf_count;

    // Of the children, the one with the lowest light stands first in the draw.
    const bool p_lower = mp.smallest_light < mq.smallest_light;
    const double of_p = luminance(p.intensity), of_q = luminance(q.intensity);
    const double random = representative_random(seed, making.smallest_light, making.largest_light, merged.leaf_count);
    const bool lower_wins = p_lower ? first_represents(of_p, of_q, random) : first_represents(of_q, of_p, random);
    const bool p_wins = lower_wins == p_lower;
    merged.representative = p_wins ? p.representative : q.representative;
    merged.children = {p_wins ? p_id : q_id, p_wins ? q_id : p_id};
    // The smaller one's block comes first; of equal ones that of the lower one in the array.
    merged.first_block_first = (p.leaf_count <= q.leaf_count) == p_wins;
    merged.first_leaves = p_wins ? p.leaf_count : q.leaf_count;
    return merged;
  }

  LC_KERNEL void put(std::uint32_t id, const MergedShape& merged) const {
    LightNode& node = nodes[id];
    node.box = merged.box;
    node.axis = merged.cone.axis;
    node.cos_half_angle = merged.cone.cos_half_angle;
  }

  LC_KERNEL void put(std::uint32_t id, const MergedSums& merged) const {
    LightNode& node = nodes[id];
    node.intensity = merged.intensity;
    node.representative = merged.representative;
    node.first_child = merged.children.first;
    node.leaf_count = merged.leaf_count;
    more[id - leaf_count] = merged.making;
    children[id - leaf_count] = merged.children;
    const std::uint32_t leaves = merged.first_leaves, others = merged.leaf_count - leaves;
    const std::uint32_t first = merged.children.first, second = merged.children.second;
    if (first >= leaf_count) parents[first - leaf_count] = {id, merged.first_block_first ? 2 : 2 * others};
    if (second >= leaf_count) parents[second - leaf_count] = {id, merged.first_block_first ? 2 * leaves : 2};
  }
};

}  // namespace detail
}  // namespace lightcuts
