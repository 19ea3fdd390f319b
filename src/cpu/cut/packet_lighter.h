#pragma once

#include "cpu/cut/packet_cut.h"
#include "cpu/tile_lighter.h"

namespace lightcuts {

/// Lights the pixels of a tile by cuts that sixteen of them choose together.
class PacketLighter final : public TileLighter {
 public:
  PacketLighter(const CutContext& context, const CutKernels& cut, const ShadeKernels& shade);
  bool light(const Tile& tile, Progress& progress, TileLight& out) const override;

 private:
  CutContext context_;
  const CutKernels& cut_;
  const ShadeKernels& shade_;
  Frontier frontier_;
};

}  // namespace lightcuts
