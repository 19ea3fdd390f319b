#pragma once

#include <functional>

#include "cpu/tree/merge_tree.h"

namespace lightcuts {

/// Told how far a builder is, in [0, 1]; returns false to stop it.
using BuildProgress = std::function<bool(double done)>;

/// Greedy clustering: merges, n - 1 times, the pair that makes the smallest cluster under the metric; ties go to the pair
/// with the lower lower id, then to that with the lower higher id.
///
/// Exactly the naive builder's result. A kd-tree over positions, axes and colours of the live clusters finds partners,
/// a priority queue orders them; O(n log n) in practice, identical lights included. `leaves` needs at least one cluster.
/// Stops early, with an empty tree, where progress asks for it.
/// Source: the study's section 2.3, Miksik 2007; queue entries and pruning as the reference's section 7.1 corrects them.
MergeTree build_agglomerative(const LeafClusters& leaves, const BuildProgress& progress = {});

}  // namespace lightcuts
