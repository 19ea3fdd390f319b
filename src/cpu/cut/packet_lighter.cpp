#include "cpu/cut/packet_lighter.h"

#include <algorithm>

#include "cpu/progress.h"

namespace lightcuts {
namespace {

/// Nodes of the first guess: a tenth of a usual cut.
constexpr std::uint32_t kFrontierSize = 64;

}  // namespace

PacketLighter::PacketLighter(const CutContext& context, const CutKernels& cut, const ShadeKernels& shade)
    : context_(context), cut_(cut), shade_(shade), frontier_(make_frontier(context.trees, kFrontierSize)) {}

bool PacketLighter::light(const Tile& tile, Progress& progress, TileLight& out) const {
  Arrival arrival;
  for (int p = 0; p < kTilePackets; ++p) {
    const SurfacePacket& packet = tile.packets[static_cast<std::size_t>(p)];
    PacketLight lit;
    cut_packet({context_, frontier_, cut_, shade_}, packet, arrival, lit);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      if ((packet.receivers.active >> lane & 1u) == 0) continue;
      const int pixel = p * kPacketSize + lane;
      out.light[pixel] = lit.light[lane];
      out.lost[pixel] = lit.lost[lane];
      record_cut(out, pixel, static_cast<std::uint64_t>(lit.size[lane]), lit.largest_bound[lane], lit.total[lane],
                 context_);
    }
    out.pairs += lit.pairs;
    out.rays += lit.rays;
    if (!progress.advance(1.0 / kTilePackets)) return false;
  }
  return true;
}

}  // namespace lightcuts
