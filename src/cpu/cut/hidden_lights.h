#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "cpu/cut/cut_context.h"
#include "kernels/group_bound.h"

namespace lightcuts {

/// Memory of find_umbras.
struct UmbraScratch {
  std::vector<Umbra> umbras;
  std::vector<std::pair<float, std::uint32_t>> candidates;
};

/// Leaves in `scratch.umbras` those of at most `most` occluders as seen from a group of receivers: the ones that cover
/// most of its sky, of those that could hide some light at all. None where the context has no occluders.
void find_umbras(const CutContext& context, const ReceiverGroup<float>& group, std::uint32_t most,
                 UmbraScratch& scratch);

}  // namespace lightcuts
