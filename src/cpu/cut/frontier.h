#pragma once

#include <array>
#include <vector>

#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"

namespace lightcuts {

/// Nodes of the trees that together hold every light, the brightest split first: a first guess of what a pixel gets.
struct Frontier {
  std::array<std::vector<CutLight>, 3> lights;  ///< by LightKind
};

/// At most `size` nodes of each tree.
Frontier make_frontier(const CutContext& context, std::uint32_t size);

}  // namespace lightcuts
