#pragma once

#include <tbb/enumerable_thread_specific.h>

#include "cpu/cut/group_cut.h"
#include "cpu/tile_lighter.h"

namespace lightcuts {

/// Lights the pixels of a tile by cuts that groups of them choose together.
class PacketLighter final : public TileLighter {
 public:
  PacketLighter(const CutContext& context, const CutKernels& cut, const ShadeKernels& shade);
  /// To be called when other lights represent the trees' nodes.
  void representatives_changed();
  bool light(const Tile& tile, Progress& progress, TileLight& out) const override;

 private:
  CutContext context_;
  const CutKernels& cut_;
  const ShadeKernels& shade_;
  Frontier frontier_;
  mutable tbb::enumerable_thread_specific<CutScratch> scratch_;
};

}  // namespace lightcuts
