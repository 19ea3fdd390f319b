#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/light_cluster.h"

namespace lightcuts {

/// Who was merged with whom: what a builder yields. Clusters 0 to n - 1 are the lights; cluster n + k was made of
/// `children[k]`, both older than itself. n - 1 merges; the last cluster is the root.
struct MergeTree {
  std::vector<std::array<std::uint32_t, 2>> children;

  [[nodiscard]] std::size_t leaf_count() const { return children.size() + 1; }
};

/// What builders start from: one cluster a light, and the metric's constants for this kind of light.
struct LeafClusters {
  std::vector<LightCluster> clusters;
  MetricScale scale;
};

}  // namespace lightcuts
