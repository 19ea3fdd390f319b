#include "cuda/packet_cut.cuh"
#include "cuda/packet_cut_by_maps.h"
#include "cuda/see_by_maps.cuh"

namespace lightcuts::cuda {
namespace {

/// All light arrives, yet each pixel has a cut of its own.
struct SeeAllOneByOne : SeeAll {
  static constexpr bool shadows = true, own_cuts = true;
};

}  // namespace

void list_packets(Device& device, const PixelView& pixels, const CutJob& job, const GroupList& list,
                  const SumView& sums, const CutView& cuts) {
  if (cuts.listing.own_cuts) {
    start_packets<true>(device, SeeAllOneByOne{}, pixels, job, list, sums, cuts);
  } else {
    start_packets<true>(device, SeeAll{}, pixels, job, list, sums, cuts);
  }
}

void list_packets_by_maps(Device& device, const MapSetView& maps, const WantedMaps& wanted, const PixelView& pixels,
                          const CutJob& job, const GroupList& list, const SumView& sums, const CutView& cuts) {
  start_packets<true>(device, SeeByMaps<std::uint16_t, 0>{maps, wanted}, pixels, job, list, sums, cuts);
}

}  // namespace lightcuts::cuda
