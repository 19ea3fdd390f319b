#pragma once

#include <cstdint>

#include "cpu/cut/group_cut.h"
#include "cpu/tile.h"

namespace lightcuts {

class RayTracer;

// A representative stands for its cluster in all pixels of a picture, so what it is off by does not average out over
// them: a whole picture may be too bright or too dark by half a percent, or by two where few lights make it up. Some pixels
// find out by how much. There, every node of the cut that is not a single light is lit again from a descendant drawn afresh
// for each pixel. The mean difference makes one factor for the whole picture, for a percent of its work; what a pixel's
// cut is off by beyond the mean stays as it is.
// Source: control variates with a coefficient of one, as in multilevel Monte Carlo (Giles 2008).

/// Differences found in test pixels.
struct CutTests {
  double difference = 0,
         difference_sq = 0;  ///< light drawn afresh less the cut's, relative to the pixel's total; summed
  double inner = 0;          ///< share of the total that nodes give that are not single lights; summed
  std::uint64_t count = 0, rays = 0, pairs = 0;

  void add(const CutTests& other);
  /// Tests after which the mean difference has this standard error.
  [[nodiscard]] double needed(double standard_error) const;
  /// The bound on nodes, relative to a pixel's total, that brings differences down to what is wanted of a picture if these are
  /// far above it at `error`; else `error`. @param promised  the bound that was asked for: what is wanted goes by it
  [[nodiscard]] double suitable_error(double error, double promised) const;
  /// By what the light of inner nodes is to be multiplied; nearer to 1 where the difference is not certain.
  [[nodiscard]] double gain() const;
};

/// A tile that was lit for the tests, at a gain of 1; kept, so that the picture need not light it again.
struct TestedTile {
  int x0 = 0, y0 = 0;
  TileLight light;
  Vec3T<double> leaves[kTilePixels];  ///< part of the light that single lights give
  CutTests tests;

  /// Writes the tile's light at the context's gain to `out`; false where some pixel's promise does not hold then.
  [[nodiscard]] bool take(const CutContext& context, const Tile& tile, TileLight& out) const;
};

/// Lights a tile and tests up to `most` of its pixels, spread over it. `tools.context.gain` must be 1.
///
/// @param tracer  of the shadow rays; null: all light arrives
/// @param seed    of the lights drawn: another one for every tile
void test_cuts(const CutTools& tools, const RayTracer* tracer, const Tile& tile, int most, std::uint64_t seed,
               CutScratch& scratch, TestedTile& out);

}  // namespace lightcuts
