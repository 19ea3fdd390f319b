#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "kernels/light_cluster.h"

namespace lightcuts::oracle {

/// Greedy clustering as its definition reads: look at all pairs of live clusters, merge the best, start again. O(n^3).
/// It shares the metric with the builder that it checks, since orders must agree to the last bit, and nothing else.
inline std::vector<std::array<std::uint32_t, 2>> greedy_merges(std::vector<LightCluster> clusters,
                                                               const MetricScale& scale) {
  std::vector<std::array<std::uint32_t, 2>> merges;
  std::vector<bool> live(clusters.size(), true);
  for (std::size_t left = clusters.size(); left > 1; --left) {
    float best = std::numeric_limits<float>::infinity();
    std::size_t p = 0, q = 0;
    for (std::size_t i = 0; i < clusters.size(); ++i) {
      for (std::size_t j = i + 1; live[i] && j < clusters.size(); ++j) {
        if (!live[j]) continue;
        const float size = cluster_size(clusters[i], clusters[j], scale);
        if (size < best) best = size, p = i, q = j;
      }
    }
    merges.push_back({static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(q)});
    live[p] = live[q] = false;
    clusters.push_back(unite(clusters[p], clusters[q]));
    live.push_back(true);
  }
  return merges;
}

}  // namespace lightcuts::oracle
