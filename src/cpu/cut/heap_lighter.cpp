#include "cpu/cut/heap_lighter.h"

#include "cpu/cut/pixel_cut.h"
#include "cpu/progress.h"

namespace lightcuts {

bool HeapLighter::light(const Tile& tile, Progress& progress, TileLight& out) const {
  PixelCut cut;
  for (int pixel = 0; pixel < kTilePixels; ++pixel) {
    const SurfacePacket& packet = tile.packets[static_cast<std::size_t>(pixel / kPacketSize)];
    const int lane = pixel % kPacketSize;
    if ((packet.receivers.active >> lane & 1u) != 0) {
      PixelLights lights(context_, packet, lane);
      cut_by_heap(context_, lights, cut);
      out.light[pixel] = cut.light;
      out.lost[pixel] = cut.lost;
      out.pairs += lights.evaluations();
      out.rays += lights.rays();
      record_cut(out, pixel, cut.nodes.size(), cut.largest_bound, cut.total, context_);
      for (const CutNode& c : cut.nodes) {
        context_.marks.set(c.kind, tree_of(context_.trees, c.kind).nodes[c.node].representative);
      }
    }
    if (!progress.advance(1.0 / kTilePixels)) return false;
  }
  return true;
}

}  // namespace lightcuts
