#include "cpu/cut/packet_lighter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "cpu/progress.h"
#include "math/sample_stream.h"

namespace lightcuts {
namespace {

/// Nodes of the first guess.
constexpr std::uint32_t kFrontierSize = 48;

/// A group may be so large because what a test saves by serving more pixels is worth more than what the cut grows, and,
/// with shadow rays, because rays of full packets cost half as much as those of sparse ones. Where nodes cost rays or looks
/// at maps, it is smaller, and the first threshold is so high that no guess is too low: a round more costs little there.
/// More umbras found hardly anything more in the rooms measured (docs/results/cut.md).
constexpr GroupTuning kUnshadowed{
    .extent = 0.06f, .cosine = 0.8f, .pixels = kTilePixels, .first_factor = 1.2f, .level_ratio = 1.5f};
constexpr GroupTuning kShadowed{.extent = 0.05f,
                                .cosine = 0.8f,
                                .pixels = kTilePixels,
                                .first_factor = 200,
                                .level_ratio = 1.2f,
                                .umbras = {.most = 32}};
/// Maps leak, and a smaller group hides more from them; in large pictures the tile is the limit anyway.
constexpr GroupTuning kByMaps{.extent = 0.03f,
                              .cosine = 0.8f,
                              .pixels = kTilePixels,
                              .first_factor = 200,
                              .level_ratio = 1.2f,
                              .umbras = {.most = 32, .least = kLeastOccluderByMaps}};

const GroupTuning& tuning_for(const PacketVisibility* visibility) {
  if (visibility == nullptr) return kUnshadowed;
  return visibility->leaks() ? kByMaps : kShadowed;
}

/// Standard error that the mean of a picture's calibration is to have: a third of what a picture may be off by, 0.2 %.
constexpr double kLevelError = 6e-4;
/// Pixels tested of a tile; in small pictures, which have few tiles, as many as come to cost as much as the tile.
constexpr int kTestsPerTile = 4, kTestsPerTileAtMost = 8;
/// Tiles after which the number of tests needed is known.
constexpr std::size_t kFirstTiles = 64;
constexpr std::uint64_t kMostTiles = 1024;

std::uint64_t corner(int x0, int y0) {
  return (std::uint64_t{static_cast<std::uint32_t>(y0)} << 32) | static_cast<std::uint32_t>(x0);
}

double fraction(double x) { return x - std::floor(x); }

std::uint64_t combine(std::uint64_t seed, std::uint32_t sample, std::uint64_t tile) {
  return derive_seed(derive_seed(seed, sample), tile);
}

int tests_of_tile(const View& view) {
  return tile_count(view) < static_cast<double>(kMostTiles) ? kTestsPerTileAtMost : kTestsPerTile;
}

/// Corners of tiles that lie evenly in the picture however many of them are taken, each once.
std::vector<std::uint64_t> spread_tiles(const View& view, std::uint32_t sample, std::uint64_t seed) {
  const auto all = static_cast<std::uint64_t>(tile_count(view));
  const std::uint64_t most = std::min(kMostTiles, all / view.sample_count);
  const Sample4 shift = philox(sample, 0, 0x706c6163u, seed);
  std::vector<std::uint64_t> tiles;
  std::unordered_set<std::uint64_t> seen;
  for (std::uint32_t k = 0; k < most; ++k) {
    // Steps of the plastic ratio's powers.
    const double x = fraction(shift.unit_double(0) + k * 0.7548776662466927);
    const double y = fraction(shift.unit_double(1) + k * 0.5698402909980532);
    const std::uint64_t at = corner(static_cast<int>(x * view.width) / kTileSide * kTileSide,
                                    static_cast<int>(y * view.height) / kTileSide * kTileSide);
    if (seen.insert(at).second) tiles.push_back(at);
  }
  return tiles;
}

}  // namespace

PacketLighter::PacketLighter(const CutContext& context, const CutKernels& cut, const ShadeKernels& shade)
    : context_(context),
      first_error_(context.error),
      cut_(cut),
      shade_(shade),
      frontier_(make_frontier(context, kFrontierSize)) {}

void PacketLighter::representatives_changed() { frontier_ = make_frontier(context_, kFrontierSize); }

CutTools PacketLighter::tools() const { return {context_, frontier_, cut_, shade_, tuning_for(context_.visibility)}; }

bool PacketLighter::light(const Tile& tile, Progress& progress, TileLight& out) const {
  const auto tested = tested_.find(corner(tile.x0, tile.y0));
  if (tested == tested_.end()) {
    cut_pixels(tools(), tile.packets, scratch_.local(), out);
    return progress.advance(1);
  }
  // It was lit, and reported, for the tests.
  if (!tested->second->take(context_, tile, out)) {
    out = {};
    cut_pixels(tools(), tile.packets, scratch_.local(), out);
  }
  return progress.advance(0);
}

CutTests PacketLighter::calibrate(const TileSource& source, std::uint32_t sample, std::uint64_t seed,
                                  float promised_error, Progress& progress) {
  context_.gain = 1;
  context_.error = first_error_;
  tested_.clear();
  const std::vector<std::uint64_t> tiles = spread_tiles(source.view, sample, seed);
  const std::size_t first = std::min(kFirstTiles, tiles.size());
  CutTests tests = test({source, sample, seed, progress}, {tiles.data(), first});
  const auto suitable = static_cast<float>(tests.suitable_error(double{first_error_}, double{promised_error}));
  if (suitable != context_.error) {
    context_.error = suitable;
    tested_.clear();
    tests = test({source, sample, seed, progress}, {tiles.data(), first});
  }
  // The samples of a pixel share the work: what remains of their errors averages out too.
  const double needed = tests.needed(kLevelError * std::sqrt(static_cast<double>(source.view.sample_count)));
  const double more =
      tests.count == 0 ? 0 : static_cast<double>(first) * (needed / static_cast<double>(tests.count) - 1);
  const auto left = static_cast<double>(tiles.size() - first);
  tests.add(test({source, sample, seed, progress},
                 {tiles.data() + first, static_cast<std::size_t>(std::clamp(more, 0.0, left))}));
  context_.gain = tests.gain();
  return tests;
}

CutTests PacketLighter::test(const Testing& testing, std::span<const std::uint64_t> tiles) {
  const TileSource& source = testing.source;
  const RayTracer* tracer = context_.visibility == nullptr ? nullptr : &source.tracer;
  std::vector<std::unique_ptr<TestedTile>> found(tiles.size());
  tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
    if (testing.progress.stopped()) return;
    const Tile tile =
        trace_tile(source.view, static_cast<int>(tiles[i] & 0xffffffffu), static_cast<int>(tiles[i] >> 32),
                   testing.sample, source.scene, source.tracer, source.emitters);
    const std::uint64_t own = combine(testing.seed, testing.sample, tiles[i]);
    found[i] = std::make_unique<TestedTile>();
    test_cuts(tools(), tracer, tile, tests_of_tile(source.view), own, scratch_.local(), *found[i]);
    testing.progress.advance(1);
  });
  CutTests sum;
  for (std::size_t i = 0; i < tiles.size() && found[i] != nullptr; ++i) {
    sum.add(found[i]->tests);
    tested_.emplace(tiles[i], std::move(found[i]));
  }
  return sum;
}

}  // namespace lightcuts
