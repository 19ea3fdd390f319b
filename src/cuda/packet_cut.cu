#include "cuda/packet_cut.cuh"

namespace lightcuts::cuda {

void cut_by_packets(Device& device, const TracedScene& traced, const PixelView& pixels, const CutJob& job,
                    bool shadow_rays, std::uint32_t first, std::uint32_t last, const SumView& sums,
                    const CutView& cuts) {
  const TileList tiles{nullptr, first, first < last ? last - first : 0};
  if (shadow_rays) {
    start_packets<false>(device, SeeByRays{{traced.scene, traced.bvh}}, pixels, job, tiles, sums, cuts);
  } else if (cuts.listing.nodes != nullptr) {
    list_packets(device, pixels, job, tiles, sums, cuts);
  } else {
    start_packets<false>(device, SeeAll{}, pixels, job, tiles, sums, cuts);
  }
}

}  // namespace lightcuts::cuda
