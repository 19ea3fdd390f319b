#pragma once

#include <cstdint>

#include "backend/light_tree_nodes.h"
#include "backend/light_tree_steps.h"
#include "backend/light_tree_tiles.h"
#include "kernels/light_key.h"

namespace lightcuts {

// The locally ordered builder of light trees over an executor (see serial_executor.h): the same clusters, order, search
// and draws as the CPU's (src/cpu/tree/ploc.h), but tile by tile (light_tree_tiles.h), as kernels that a GPU runs. Nothing
// depends on timing: ids come from places on the curve, ties from positions, a representative from the lights below.
// Source: Meister, Bittner 2018, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction".

/// Choices of the builder; docs/results/tree.md says how they were made.
struct LightTreeBuild {
  MetricScale scale;
  std::uint64_t seed = 1;
  std::uint32_t radius = 8;         ///< neighbours searched to each side, at most kLargestPlocRadius
  std::uint32_t upper_radius = 12;  ///< the same, among the few clusters of later passes
  LightKeyLayout layout;
};

namespace detail {

/// Executors that merge in launches of their own: merge_leaves(make_leaves, pass) makes the leaves and does the first
/// pass, merge_tiles(pass) does another one, as MakeLeaves and MergeTile do, to the bit.
template <class Exec>
concept MergesTiles = requires(Exec& exec, const TilePass& pass) {
  exec.merge_tiles(pass);
};

}  // namespace detail

/// A tree over one kind of light in an executor's memory.
template <class Exec>
struct BuiltLightTree {
  typename Exec::template Buffer<LightNode> storage;
  std::uint32_t leaf_count = 0, depth = 0;

  [[nodiscard]] std::uint32_t node_count() const { return leaf_count == 0 ? 0 : 2 * leaf_count - 1; }
  /// Node 0 stands one place in, so that siblings share an aligned pair of cache lines.
  [[nodiscard]] const LightNode* nodes() const { return leaf_count == 0 ? nullptr : storage.data() + 1; }
};

/// Most lights of one kind: ids of merged nodes keep their top bit free.
inline constexpr std::uint32_t kMostTreeLights = (1u << 30) - 1;

/// Most that building holds at once for each light, the lights not included, the tree included [bytes].
inline constexpr std::uint64_t kTreeBuildBytes =
    2 * 2 * sizeof(LightNode) + sizeof(detail::NodeMaking) + 2 * sizeof(detail::NodeParent) + 32;

/// Builds the tree over `count` lights, at most kMostTreeLights. Deterministic: the same for any executor, but for the
/// rounding of a compiler that contracts operations.
template <class Exec, class Light>
BuiltLightTree<Exec> build_light_tree(Exec& exec, const Light* lights, std::uint32_t count,
                                      const LightTreeBuild& options) {
  using namespace detail;
  BuiltLightTree<Exec> tree;
  tree.leaf_count = count;
  if (count == 0) return tree;

  auto summary = exec.template allocate<LightSummary>(1);
  if constexpr (requires { exec.summarise(lights, count, summary.data()); }) {
    exec.summarise(lights, count, summary.data());
  } else {
    exec.for_each(1, SummariseLights<Light>{lights, summary.data(), count});
  }

  const std::uint32_t node_count = 2 * count - 1, radius = clamp_to(options.radius, 1u, kLargestPlocRadius);
  const std::uint32_t upper_radius = clamp_to(options.upper_radius, 1u, kLargestPlocRadius);
  auto by_id = exec.template allocate<LightNode>(node_count);
  auto more = exec.template allocate<NodeMaking>(count);
  auto parents = exec.template allocate<NodeParent>(count);
  auto children = exec.template allocate<NodeChildren>(count);
  const NodesMaking making{by_id.data(),  more.data(),    parents.data(), children.data(),
                           options.scale, summary.data(), options.seed,   count};
  auto root = exec.template allocate<TreeRoot>(1);
  const KeyPacking packing = pack_keys(count);
  {
    auto keys = exec.template allocate<std::uint64_t>(count);
    exec.for_each(count, KeyLights<Light>{lights, summary.data(), options.layout, packing, keys.data()});
    exec.sort_words(keys, packing.index_bits, packing.index_bits + packing.key_bits);
    const MakeLeaves<Light> make_leaves{lights, keys.data(), packing, making};
    for_each_tile_pass(exec, making, radius, upper_radius, root.data(), [&](const TilePass& pass) {
      if constexpr (MergesTiles<Exec>) {
        if (pass.from == nullptr) {
          exec.merge_leaves(make_leaves, pass);
        } else {
          exec.merge_tiles(pass);
        }
      } else {
        if (pass.from == nullptr) exec.for_each(count, make_leaves);
        exec.for_each(pass.tile_count, MergeTile(pass));
      }
    });
  }
  tree.storage = exec.template allocate<LightNode>(std::size_t{node_count} + 1);
  if (count == 1) {
    exec.for_each(1, PlaceLeaf{making, tree.storage.data() + 1});
    tree.depth = 1;
    return tree;
  }
  if constexpr (requires { exec.place(making, root.data(), tree.storage.data()); }) {
    exec.place(making, root.data(), tree.storage.data() + 1);
  } else {
    exec.for_each(count - 1, PlaceChildren{making, root.data(), tree.storage.data() + 1});
  }
  tree.depth = exec.fetch(root.data()).height;
  return tree;
}

}  // namespace lightcuts
