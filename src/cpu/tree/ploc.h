#pragma once

#include <cstdint>

#include "cpu/tree/agglomerative.h"
#include "cpu/tree/merge_tree.h"
#include "kernels/light_key.h"

namespace lightcuts {

/// Choices of the locally ordered builder, measured in docs/results/tree.md.
struct PlocOptions {
  std::uint32_t radius = 8;          ///< neighbours searched to each side, at most kLargestPlocRadius
  std::uint32_t greedy_below = 256;  ///< so many clusters are left to the agglomerative builder
  LightKeyLayout layout;
};

/// Parallel locally ordered clustering: sorts clusters along a Morton curve through position and direction; in rounds,
/// each finds its best partner among its neighbours in that order, and those that chose each other merge.
///
/// The same for any number of threads. `leaves` needs at least one cluster. Stops early, with an empty tree, where
/// progress asks for it. Source: Meister and Bittner 2018.
MergeTree build_ploc(const LeafClusters& leaves, const PlocOptions& options = {}, const BuildProgress& progress = {});

/// The simplest builder: a radix tree over the lights' Morton codes (Karras 2012), whatever the metric.
MergeTree build_morton(const LeafClusters& leaves, const LightKeyLayout& layout = {});

/// Lights in the order of their keys. Of equal keys, the lower index first.
struct KeyedLight {
  std::uint64_t key;
  std::uint32_t light;
};
std::vector<KeyedLight> sort_by_key(const std::vector<LightCluster>& clusters, const LightKeyLayout& layout);

}  // namespace lightcuts
