#include "cpu/cut/packet_lighter.h"

#include "cpu/progress.h"

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
constexpr GroupTuning kShadowed{
    .extent = 0.05f, .cosine = 0.8f, .pixels = kTilePixels, .first_factor = 200, .level_ratio = 1.2f, .umbras = 32};
/// Maps leak, and a smaller group hides more from them; in large pictures the tile is the limit anyway.
constexpr GroupTuning kByMaps{
    .extent = 0.03f, .cosine = 0.8f, .pixels = kTilePixels, .first_factor = 200, .level_ratio = 1.2f, .umbras = 32};

const GroupTuning& tuning_for(const PacketVisibility* visibility) {
  if (visibility == nullptr) return kUnshadowed;
  return visibility->leaks() ? kByMaps : kShadowed;
}

}  // namespace

PacketLighter::PacketLighter(const CutContext& context, const CutKernels& cut, const ShadeKernels& shade)
    : context_(context), cut_(cut), shade_(shade), frontier_(make_frontier(context, kFrontierSize)) {}

void PacketLighter::representatives_changed() { frontier_ = make_frontier(context_, kFrontierSize); }

bool PacketLighter::light(const Tile& tile, Progress& progress, TileLight& out) const {
  cut_pixels({context_, frontier_, cut_, shade_, tuning_for(context_.visibility)}, tile.packets, scratch_.local(), out);
  return progress.advance(1);
}

}  // namespace lightcuts
