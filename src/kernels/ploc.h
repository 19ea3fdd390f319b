#pragma once

#include <cstdint>

#include "lightcuts/math.h"

namespace lightcuts {

// Parallel locally-ordered clustering: clusters lie in an array along a space-filling curve; each looks for its best
// partner among its neighbours, mutual pairs merge, the array closes its gaps, until one cluster is left.
// Source: Meister, Bittner 2018, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction".
//
// What a cluster is and how far apart two are comes from `Clusters`, a plain struct of pointers with
//   float distance(uint32 a, uint32 b) const    symmetric in its arguments
//   void merge(uint32 parent, uint32 a, uint32 b) const
// over node ids: 0..n-1 are the leaves, in the order of the curve; n..2n-2 are the merged ones in order of creation.
// Nothing depends on timing: ids come from a prefix sum, ties from positions.

/// Finds each cluster's best partner within `radius` places.
template <class Clusters>
struct PlocNearest {
  Clusters clusters;
  const std::uint32_t* ids;
  std::uint32_t* nearest;
  std::uint32_t count;
  std::uint32_t radius;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const std::uint32_t begin = i > radius ? i - radius : 0;
    const std::uint32_t end = min_of(count, i + radius + 1);
    std::uint32_t best = i;
    float best_distance = kInfinity;
    for (std::uint32_t j = begin; j < end; ++j) {
      if (j == i) continue;
      const float d = clusters.distance(ids[i], ids[j]);
      // Ties: the pair with the lower, then the higher place in front. This order of pairs is total, so its first
      // pair is mutual and every round merges at least one.
      if (best == i || d < best_distance || (d == best_distance && before(i, j, best))) {
        best = j;
        best_distance = d;
      }
    }
    nearest[i] = best;
  }

  /// Pair (i, j) before pair (i, k)?
  LC_FN static bool before(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    const std::uint32_t lo_j = min_of(i, j), lo_k = min_of(i, k);
    return lo_j != lo_k ? lo_j < lo_k : max_of(i, j) < max_of(i, k);
  }
};

/// Marks what stays in the array (low half) and what merges (high half), ready for one prefix sum.
struct PlocFlags {
  const std::uint32_t* nearest;
  std::uint64_t* flags;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const std::uint32_t partner = nearest[i];
    const bool mutual = partner != i && nearest[partner] == i;
    const bool merges = mutual && i < partner;
    const bool stays = !mutual || merges;
    flags[i] = (merges ? std::uint64_t{1} << 32 : 0) | (stays ? 1u : 0u);
  }
};

/// Merges the mutual pairs and writes the closed-up array.
template <class Clusters>
struct PlocMerge {
  Clusters clusters;
  const std::uint32_t* ids;
  const std::uint32_t* nearest;
  const std::uint64_t* flags;
  const std::uint64_t* offsets;
  std::uint32_t* next_ids;
  std::uint32_t first_new_id;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const std::uint64_t flag = flags[i], offset = offsets[i];
    if ((flag & 1u) == 0) return;
    std::uint32_t id = ids[i];
    if (flag >> 32) {
      const std::uint32_t parent = first_new_id + static_cast<std::uint32_t>(offset >> 32);
      clusters.merge(parent, id, ids[nearest[i]]);
      id = parent;
    }
    next_ids[static_cast<std::uint32_t>(offset)] = id;
  }
};

struct PlocIota {
  std::uint32_t* ids;
  LC_KERNEL void operator()(std::uint32_t i) const { ids[i] = i; }
};

/// Clusters n leaves into a binary tree; the root gets the id 2 n - 2 (0 for a single leaf). n >= 1.
///
/// `Exec` runs for_each and exclusive_scan on some processor (see serial_executor.h).
template <class Exec, class Clusters>
void build_ploc(Exec& exec, const Clusters& clusters, std::uint32_t n, std::uint32_t radius) {
  auto ids = exec.template allocate<std::uint32_t>(n);
  auto next_ids = exec.template allocate<std::uint32_t>(n);
  auto nearest = exec.template allocate<std::uint32_t>(n);
  auto flags = exec.template allocate<std::uint64_t>(n);
  auto offsets = exec.template allocate<std::uint64_t>(n);
  exec.for_each(n, PlocIota{ids.data()});
  std::uint32_t first_new_id = n;
  for (std::uint32_t count = n; count > 1;) {
    exec.for_each(count, PlocNearest<Clusters>{clusters, ids.data(), nearest.data(), count, radius});
    exec.for_each(count, PlocFlags{nearest.data(), flags.data()});
    const std::uint64_t total = exec.exclusive_scan(flags.data(), offsets.data(), count);
    exec.for_each(count, PlocMerge<Clusters>{clusters, ids.data(), nearest.data(), flags.data(), offsets.data(),
                                             next_ids.data(), first_new_id});
    std::swap(ids, next_ids);
    first_new_id += static_cast<std::uint32_t>(total >> 32);
    count = static_cast<std::uint32_t>(total);
  }
}

}  // namespace lightcuts
