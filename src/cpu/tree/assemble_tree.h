#pragma once

#include <cstdint>

#include "backend/light_tree.h"
#include "cpu/tree/merge_tree.h"

namespace lightcuts {

/// Makes the tree that cuts walk from a builder's merges: bounds, sums, representatives and the order in memory.
///
/// A cluster's representative is one child's, chosen in proportion to luminance by a random number that depends on `seed`
/// and the smallest and largest light index below and their number alone. The same for any number of threads.
/// Source: Walter et al. 2005; the reference's sections 1.3 and 1.5.
LightTree assemble_tree(const MergeTree& merges, const std::vector<LightCluster>& leaves, std::uint64_t seed);

}  // namespace lightcuts
