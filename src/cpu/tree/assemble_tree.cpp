#include "cpu/tree/assemble_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace lightcuts {
namespace {

/// What a node needs of its children beside what LightNode keeps.
struct NodeDetail {
  std::uint32_t smallest_light = 0, largest_light = 0;
  Vec3 intensity_rest;  ///< what rounding took from the sum: chains of a million lights stay exact
};

class TreeAssembly {
 public:
  TreeAssembly(const MergeTree& merges, const std::vector<LightCluster>& leaves, std::uint64_t seed)
      : merges_(merges), leaves_(leaves), seed_(seed), light_count_(static_cast<std::uint32_t>(leaves.size())) {
    tree_.nodes.resize(2 * std::size_t{light_count_} - 1);
    details_.resize(tree_.nodes.size());
  }

  LightTree run() {
    count_leaves();
    place_nodes();
    // Nodes stand behind their parents, so a sweep from the back finds children done. Blocks of subtrees are apart.
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
      for (std::uint32_t k = blocks_[b].end; k-- > blocks_[b].begin;) finish_node(k);
    });
    for (std::size_t k = upper_nodes_.size(); k-- > 0;) finish_node(upper_nodes_[k]);
    return std::move(tree_);
  }

 private:
  struct Block {
    std::uint32_t begin, end;
  };
  /// A cluster, the place of its node, and where its descendants go.
  struct Placement {
    std::uint32_t cluster, node, block, depth;
  };

  void count_leaves() {
    leaf_counts_.resize(merges_.children.size());
    for (std::size_t k = 0; k < leaf_counts_.size(); ++k)
      leaf_counts_[k] = leaves_below(merges_.children[k][0]) + leaves_below(merges_.children[k][1]);
  }
  [[nodiscard]] std::uint32_t leaves_below(std::uint32_t cluster) const {
    return cluster < light_count_ ? 1 : leaf_counts_[cluster - light_count_];
  }

  void place_nodes();
  void place_subtree(Placement root, std::uint32_t block_limit, std::vector<Placement>* subtrees, std::uint32_t& depth);
  void finish_node(std::uint32_t index);
  void finish_leaf(LightNode& node, NodeDetail& detail) const;
  void finish_inner(LightNode& node, NodeDetail& detail);

  const MergeTree& merges_;
  const std::vector<LightCluster>& leaves_;
  std::uint64_t seed_;
  std::uint32_t light_count_;
  std::vector<std::uint32_t> leaf_counts_;  ///< of inner clusters
  LightTree tree_;
  std::vector<NodeDetail> details_;         ///< by node
  std::vector<Block> blocks_;               ///< nodes of subtrees that one thread finishes
  std::vector<std::uint32_t> upper_nodes_;  ///< all others, parents first
};

/// Gives the nodes below `root` their places. Subtrees of at most `block_limit` leaves are left to `subtrees` if given.
void TreeAssembly::place_subtree(Placement root, std::uint32_t block_limit, std::vector<Placement>* subtrees,
                                 std::uint32_t& depth) {
  std::vector<Placement> pending{root};
  while (!pending.empty()) {
    const Placement top = pending.back();
    pending.pop_back();
    LightNode& node = tree_.nodes[top.node];
    node.leaf_count = leaves_below(top.cluster);
    if (subtrees != nullptr) {
      upper_nodes_.push_back(top.node);
      if (node.leaf_count > 1 && node.leaf_count <= block_limit) {
        blocks_.push_back({top.block, top.block + 2 * (node.leaf_count - 1)});
        subtrees->push_back(top);
        continue;
      }
    }
    depth = max_of(depth, top.depth);
    if (top.cluster < light_count_) {
      node.representative = top.cluster;
      continue;
    }
    auto [small, large] = merges_.children[top.cluster - light_count_];
    if (leaves_below(large) < leaves_below(small)) std::swap(small, large);
    node.first_child = top.block;
    const std::uint32_t small_block = top.block + 2, large_block = small_block + 2 * (leaves_below(small) - 1);
    pending.push_back({large, top.block + 1, large_block, top.depth + 1});
    pending.push_back({small, top.block, small_block, top.depth + 1});
  }
}

void TreeAssembly::place_nodes() {
  const std::uint32_t root = static_cast<std::uint32_t>(tree_.nodes.size()) - light_count_;  // n - 1 merges
  const Placement whole{light_count_ > 1 ? light_count_ + root - 1 : 0, 0, 1, 1};
  std::vector<Placement> subtrees;
  place_subtree(whole, max_of(light_count_ / 64, 256u), &subtrees, tree_.depth);
  std::vector<std::uint32_t> depths(subtrees.size(), 0);
  tbb::parallel_for(std::size_t{0}, subtrees.size(),
                    [&](std::size_t s) { place_subtree(subtrees[s], 0, nullptr, depths[s]); });
  for (const std::uint32_t depth : depths) tree_.depth = max_of(tree_.depth, depth);
}

void TreeAssembly::finish_node(std::uint32_t index) {
  LightNode& node = tree_.nodes[index];
  if (node.is_leaf()) {
    finish_leaf(node, details_[index]);
  } else {
    finish_inner(node, details_[index]);
  }
}

void TreeAssembly::finish_leaf(LightNode& node, NodeDetail& detail) const {
  const LightCluster& light = leaves_[node.representative];
  node.box = light.box;
  node.axis = light.cone.axis;
  node.cos_half_angle = light.cone.cos_half_angle;
  node.intensity = light.intensity;
  detail = {node.representative, node.representative, {}};
}

/// Sum in float with the rest that rounding left.
void add_exactly(float& sum, float& rest, float sum_p, float rest_p, float sum_q, float rest_q) {
  const double exact = (static_cast<double>(sum_p) + rest_p) + (static_cast<double>(sum_q) + rest_q);
  sum = static_cast<float>(exact);
  rest = static_cast<float>(exact - sum);
}

void TreeAssembly::finish_inner(LightNode& node, NodeDetail& detail) {
  LightNode &p = tree_.nodes[node.first_child], &q = tree_.nodes[node.second_child()];
  NodeDetail &dp = details_[node.first_child], &dq = details_[node.second_child()];
  node.box = extend(p.box, q.box);
  const DirectionCone cone = unite(DirectionCone{p.axis, p.cos_half_angle}, DirectionCone{q.axis, q.cos_half_angle});
  node.axis = cone.axis;
  node.cos_half_angle = cone.cos_half_angle;
  const Vec3 rest_p = dp.intensity_rest, rest_q = dq.intensity_rest;
  Vec3& sum = node.intensity;
  Vec3& rest = detail.intensity_rest;
  add_exactly(sum.x, rest.x, p.intensity.x, rest_p.x, q.intensity.x, rest_q.x);
  add_exactly(sum.y, rest.y, p.intensity.y, rest_p.y, q.intensity.y, rest_q.y);
  add_exactly(sum.z, rest.z, p.intensity.z, rest_p.z, q.intensity.z, rest_q.z);
  detail.smallest_light = min_of(dp.smallest_light, dq.smallest_light);
  detail.largest_light = max_of(dp.largest_light, dq.largest_light);

  // Of the children, the one with the lowest light stands first in the draw, whatever order the builder gave them.
  const bool p_lower = dp.smallest_light < dq.smallest_light;
  const double of_p = luminance(p.intensity), of_q = luminance(q.intensity);
  const double random = representative_random(seed_, detail.smallest_light, detail.largest_light, node.leaf_count);
  const bool lower_wins = p_lower ? first_represents(of_p, of_q, random) : first_represents(of_q, of_p, random);
  if (lower_wins != p_lower) {
    std::swap(p, q);
    std::swap(dp, dq);
  }
  node.representative = p.representative;
}

}  // namespace

LightTree assemble_tree(const MergeTree& merges, const std::vector<LightCluster>& leaves, std::uint64_t seed) {
  if (leaves.empty()) return {};
  return TreeAssembly(merges, leaves, seed).run();
}

}  // namespace lightcuts
