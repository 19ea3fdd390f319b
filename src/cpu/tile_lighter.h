#pragma once

#include "cpu/tile.h"

namespace lightcuts {

class Progress;

/// Lights the receivers of a tile: one implementation a method (all lights, a cut by a heap a pixel, a cut by packets).
class TileLighter {
 public:
  virtual ~TileLighter() = default;

  /// Fills `out`, which starts as zeros. Reports `1` unit of work over the whole tile to `progress`, and returns false
  /// as soon as that says stop: the tile is then not used. Called by many threads at once.
  virtual bool light(const Tile& tile, Progress& progress, TileLight& out) const = 0;
};

}  // namespace lightcuts
