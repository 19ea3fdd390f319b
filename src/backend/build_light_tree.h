#pragma once

#include <cstdint>
#include <utility>

#include "backend/light_tree_nodes.h"
#include "backend/light_tree_steps.h"
#include "kernels/light_key.h"

namespace lightcuts {

// The locally ordered builder of light trees over an executor (see serial_executor.h): the same clusters, order, search
// and draws as the CPU's (src/cpu/tree/ploc.h), as kernels that a GPU runs. Nothing depends on timing: ids come from
// prefix sums, ties from positions, a representative from the lights below.
// Source: Meister, Bittner 2018, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction".

/// Choices of the builder; docs/results/tree.md says how they were made.
struct LightTreeBuild {
  MetricScale scale;
  std::uint64_t seed = 1;
  std::uint32_t radius = 8;             ///< neighbours searched to each side, at most kLargestPlocRadius
  std::uint32_t search_all_below = 32;  ///< so few clusters each look at all others: nearly the greedy result
  LightKeyLayout layout;
};

namespace detail {

/// Executors that merge in launches of their own: merge_clusters(making, ids, radius, search_all_below) does what the
/// rounds below do, to the bit.
template <class Exec>
concept MergesItself = requires(Exec& exec, const NodesMaking& making,
                                typename Exec::template Buffer<std::uint32_t>& ids) {
  exec.merge_clusters(making, ids, 8u, 256u);
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

namespace detail {

/// Merges all clusters.
template <class Exec>
void merge_in_rounds(Exec& exec, const NodesMaking& making, typename Exec::template Buffer<std::uint32_t>& ids,
                     std::uint32_t radius, std::uint32_t search_all_below) {
  const std::uint32_t count = making.leaf_count;
  std::uint32_t new_id = count;
  auto next_ids = exec.template allocate<std::uint32_t>(count);
  auto offsets = exec.template allocate<std::int32_t>(count);
  auto flags = exec.template allocate<std::uint64_t>(count);
  auto places = exec.template allocate<std::uint64_t>(count);
  auto found = exec.template allocate<RankedPartner>(std::size_t{min_of(count, search_all_below)} * kSearchParts);
  int reluctance = 0;  // rounds before that merged hardly anything
  for (std::uint32_t live = count; live > 1;) {
    if (live <= search_all_below) {
      exec.for_each(live * kSearchParts, FindAmongAll{making, ids.data(), found.data(), live});
      exec.for_each(live, JoinSearch{found.data(), offsets.data()});
    } else {
      exec.for_each(live, FindPartners{making, ids.data(), offsets.data(), live, radius});
    }
    if (reluctance > 0) exec.for_each(live / 2, PairNeighbours{offsets.data(), live, reluctance > 1});
    exec.for_each(live, MarkMerges{offsets.data(), flags.data()});
    const std::uint64_t total = exec.exclusive_scan(flags.data(), places.data(), live);
    exec.for_each(live,
                  MergePairs{making, ids.data(), offsets.data(), flags.data(), places.data(), next_ids.data(), new_id});
    std::swap(ids, next_ids);
    const auto merged = static_cast<std::uint32_t>(total >> 32);
    reluctance = reluctance_after(reluctance, live, merged, search_all_below);
    new_id += merged;
    live = static_cast<std::uint32_t>(total);
  }
}

}  // namespace detail

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
  auto by_id = exec.template allocate<LightNode>(node_count);
  auto more = exec.template allocate<NodeMaking>(count);
  auto parents = exec.template allocate<NodeParent>(count);
  auto children = exec.template allocate<NodeChildren>(count);
  const NodesMaking making{by_id.data(),  more.data(),    parents.data(), children.data(),
                           options.scale, summary.data(), options.seed,   count};
  auto ids = exec.template allocate<std::uint32_t>(count);
  {
    const KeyPacking packing = pack_keys(count);
    auto keys = exec.template allocate<std::uint64_t>(count);
    exec.for_each(count, KeyLights<Light>{lights, summary.data(), options.layout, packing, keys.data()});
    exec.sort_words(keys, packing.index_bits, packing.index_bits + packing.key_bits);
    exec.for_each(count, MakeLeaves<Light>{lights, keys.data(), packing, making, ids.data()});
  }
  tree.storage = exec.template allocate<LightNode>(std::size_t{node_count} + 1);
  if constexpr (MergesItself<Exec>) {
    exec.merge_clusters(making, ids, radius, options.search_all_below);
  } else {
    merge_in_rounds(exec, making, ids, radius, options.search_all_below);
  }
  if (count == 1) {
    exec.for_each(1, PlaceLeaf{making, tree.storage.data() + 1});
    tree.depth = 1;
    return tree;
  }
  if constexpr (requires { exec.place(making, tree.storage.data()); }) {
    exec.place(making, tree.storage.data() + 1);
  } else {
    exec.for_each(count - 1, PlaceChildren{making, tree.storage.data() + 1});
  }
  tree.depth = exec.fetch(more.data() + (count - 2)).height;
  return tree;
}

}  // namespace lightcuts
