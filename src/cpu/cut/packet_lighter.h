#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <memory>
#include <span>
#include <unordered_map>

#include "cpu/cut/calibration.h"
#include "cpu/cut/group_cut.h"
#include "cpu/shade_picture.h"
#include "cpu/tile_lighter.h"

namespace lightcuts {

/// Lights the pixels of a tile by cuts that groups of them choose together.
class PacketLighter final : public TileLighter {
 public:
  PacketLighter(const CutContext& context, const CutKernels& cut, const ShadeKernels& shade);
  /// To be called when other lights represent the trees' nodes.
  void representatives_changed();
  /// Finds by what the representatives of a sample of a picture are off on average, and takes it from all light from now
  /// on; returns what was tested. The bound on nodes becomes finer than `promised_error` asks for where representatives are off by
  /// far more than is usual. The tiles lit for it need not be lit again.
  CutTests calibrate(const TileSource& source, std::uint32_t sample, std::uint64_t seed, float promised_error,
                     Progress& progress);
  /// What the light of nodes that are not single lights is multiplied by.
  [[nodiscard]] double gain() const { return context_.gain; }
  bool light(const Tile& tile, Progress& progress, TileLight& out) const override;

 private:
  struct Testing {
    const TileSource& source;
    std::uint32_t sample;
    std::uint64_t seed;
    Progress& progress;
  };

  [[nodiscard]] CutTools tools() const;
  CutTests test(const Testing& testing, std::span<const std::uint64_t> tiles);

  CutContext context_;
  float first_error_;  ///< bound before the tests
  const CutKernels& cut_;
  const ShadeKernels& shade_;
  Frontier frontier_;
  /// Tiles of the current sample that are lit already, by their corner.
  std::unordered_map<std::uint64_t, std::unique_ptr<TestedTile>> tested_;
  mutable tbb::enumerable_thread_specific<CutScratch> scratch_;
};

}  // namespace lightcuts
