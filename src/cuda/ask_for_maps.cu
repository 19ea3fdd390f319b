#include "cuda/packet_cut.cuh"
#include "cuda/packet_cut_by_maps.h"
#include "cuda/see_by_maps.cuh"

namespace lightcuts::cuda {

void ask_for_maps(Device& device, const MapSetView& maps, const WantedMaps& wanted, const PixelView& pixels,
                  const CutJob& job, const GroupList& list, const CutView& cuts) {
  if (maps.depth_bits == 32) {
    start_packets<false>(device, AskForMaps<std::uint32_t>{{maps, wanted}}, pixels, job, list, {}, cuts);
  } else {
    start_packets<false>(device, AskForMaps<std::uint16_t>{{maps, wanted}}, pixels, job, list, {}, cuts);
  }
}

}  // namespace lightcuts::cuda
