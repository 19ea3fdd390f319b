#pragma once

#include <cstdint>
#include <vector>

#include "kernels/pull_push.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// Work memory of fill_holes, so that filling many maps allocates once.
template <class Depth>
struct FillScratch {
  /// A coarser level, as far as it was asked for.
  struct Level {
    int size = 0;
    std::vector<Depth> pulled, pushed;
    std::vector<std::uint8_t> known;  ///< a texel: bit 0: its pulled, bit 1: its pushed code is there
  };
  std::vector<Level> coarser;
  struct Hole {
    std::uint32_t texel;
    Depth code;
  };
  std::vector<Hole> holes;
};

/// Fills the texels of a map in which nothing was drawn from up to `levels` coarser levels, by pull and push.
///
/// Texels that hold a depth keep it. A side that is odd is rounded up: texels beyond the border are empty.
/// @param map   size * size codes, row by row
/// @param fill  HoleFill::mean: the study's mean of valid texels and push of the parent's value;
///              HoleFill::edges: only texels of the farthest surface are averaged, and holes take the farthest mean near them
template <class Depth>
void fill_holes(Depth* map, int size, int levels, HoleFill fill, FillScratch<Depth>& scratch);

extern template void fill_holes(std::uint16_t*, int, int, HoleFill, FillScratch<std::uint16_t>&);
extern template void fill_holes(std::uint32_t*, int, int, HoleFill, FillScratch<std::uint32_t>&);

}  // namespace lightcuts
