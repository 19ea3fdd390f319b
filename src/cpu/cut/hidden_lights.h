#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"
#include "cpu/cut/frontier.h"
#include "kernels/group_bound.h"

namespace lightcuts {

/// Memory of UmbraFinder.
struct UmbraScratch {
  std::vector<Umbra> umbras;
  std::vector<std::uint32_t> near;  ///< occluders that may hide lights from some group of a tile
  std::vector<std::pair<float, std::uint32_t>> candidates;
  std::vector<std::uint16_t> places, directions;
};

/// Which occluders are looked at for a group.
struct UmbraLimits {
  std::uint32_t most = 0;  ///< how many, 0: none
  float least = 0;         ///< that one must weigh, see occluder_weight
};

/// Finds what hides lights from the groups of a tile. Everything referred to must outlive it.
class UmbraFinder {
 public:
  /// @param receivers  of all groups that will be asked for
  UmbraFinder(const CutContext& context, const Frontier& frontier, const CutKernels& kernels, const Box& receivers,
              const UmbraLimits& limits, UmbraScratch& scratch);

  /// Leaves in the scratch's `umbras` those of the occluders that cover most of the group's sky, if they hide a sample of
  /// the lights that none before them hides. None where the context has no occluders.
  void find(const ReceiverGroup<float>& group) const;

 private:
  [[nodiscard]] bool hides_more(const Umbra& umbra) const;

  const CutContext& context_;
  const Frontier& frontier_;
  const CutKernels& kernels_;
  UmbraLimits limits_;
  UmbraScratch& scratch_;
  Box lights_;
  bool far_lights_;
};

}  // namespace lightcuts
