#include "cuda/packet_cut.cuh"

namespace lightcuts::cuda {
namespace {

/// All light arrives, yet each pixel has a cut of its own.
struct SeeAllOneByOne {
  static constexpr bool tests = true, traces = false;
  template <int kind>
  __device__ float share(const Receiver<FastFloat>&, Vec3, const StagedLight&) const {
    return 1;
  }
};

}  // namespace

void list_packets(Device& device, const PixelView& pixels, const CutJob& job, std::uint32_t first, std::uint32_t last,
                  const SumView& sums, const CutView& cuts) {
  if (cuts.listing.own_cuts) {
    start_packets<true>(device, SeeAllOneByOne{}, pixels, job, first, last, sums, cuts);
  } else {
    start_packets<true>(device, SeeAll{}, pixels, job, first, last, sums, cuts);
  }
}

}  // namespace lightcuts::cuda
