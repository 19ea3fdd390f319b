#pragma once

#include "cpu/cut/cut_context.h"
#include "cpu/tile_lighter.h"

namespace lightcuts {

/// Lights each pixel by its own cut, refined by a priority queue: the textbook algorithm, the gold for all faster ones.
class HeapLighter final : public TileLighter {
 public:
  explicit HeapLighter(const CutContext& context) : context_(context) {}
  bool light(const Tile& tile, Progress& progress, TileLight& out) const override;

 private:
  CutContext context_;
};

}  // namespace lightcuts
