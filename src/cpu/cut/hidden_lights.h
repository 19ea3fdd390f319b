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

/// Finds what hides lights from the groups of a tile. Everything referred to must outlive it.
class UmbraFinder {
 public:
  /// @param receivers  of all groups that will be asked for
  /// @param most       occluders that are looked at for a group, 0: none
  UmbraFinder(const CutContext& context, const Frontier& frontier, const CutKernels& kernels, const Box& receivers,
              std::uint32_t most, UmbraScratch& scratch);

  /// Leaves in the scratch's `umbras` those of the occluders that cover most of the group's sky, if they hide a sample of
  /// the lights that none before them hides. None where the context has no occluders.
  void find(const ReceiverGroup<float>& group) const;

 private:
  [[nodiscard]] bool hides_more(const Umbra& umbra) const;

  const CutContext& context_;
  const Frontier& frontier_;
  const CutKernels& kernels_;
  std::uint32_t most_;
  UmbraScratch& scratch_;
  Box lights_;
  bool far_lights_;
};

}  // namespace lightcuts
