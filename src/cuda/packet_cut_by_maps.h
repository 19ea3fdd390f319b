#pragma once

#include "cuda/light_maps.h"
#include "cuda/packet_cut.h"

namespace lightcuts::cuda {

/// Looks up lights that have maps from all pixels of a tile: shares[32 * i + lane] receives what arrives of light
/// ids[i].
void look_up_tile(Device& device, const MapSetView& maps, const PixelView& pixels, const LightArrays& lights,
                  std::uint32_t tile, int kind, const std::uint32_t* ids, std::uint32_t count, std::uint8_t* shares);

/// As cut_by_packets, with visibility by shadow maps. Groups that want a map that is missing are left, and listed in
/// list.missed; their lights without a map are marked as wanted.
void cut_by_packets(Device& device, const MapSetView& maps, const WantedMaps& wanted, const ShareTable& table,
                    const PixelView& pixels, const CutJob& job, const GroupList& list, const SumView& sums,
                    const CutView& cuts);

/// Marks about those lights as wanted that cut_by_packets will want, by walks that look only at the upper levels'
/// lights: for a picture of which hardly any maps are there. Of `cuts` only the cost is written.
void ask_for_maps(Device& device, const MapSetView& maps, const WantedMaps& wanted, const PixelView& pixels,
                  const CutJob& job, const GroupList& list, const CutView& cuts);

/// As cut_by_packets for maps of 16 bits, and lists the nodes: for tests.
void list_packets_by_maps(Device& device, const MapSetView& maps, const WantedMaps& wanted, const PixelView& pixels,
                          const CutJob& job, const GroupList& list, const SumView& sums, const CutView& cuts);

}  // namespace lightcuts::cuda
