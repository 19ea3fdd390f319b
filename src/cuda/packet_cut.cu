#include "cuda/packet_cut.cuh"

namespace lightcuts::cuda {
namespace {

/// Memory for the rays of all warps and blocks that are at work at the same time, where there is plenty.
class RememberedRaysBuffer {
 public:
  explicit RememberedRaysBuffer(Device& device) {
    constexpr std::size_t of_warps = std::size_t{kCutBlocks} * kCutWarps * RayMemory::kOfWarp,
                          of_blocks = std::size_t{kCrewResident} * RayMemory::kOfBlock;
    const std::size_t entries = static_cast<std::size_t>(device.multiprocessors()) * std::max(of_warps, of_blocks);
    constexpr std::uint64_t share = 4;  // of what is left, at most
    if (device.used() + share * entries * (sizeof(std::uint32_t) + sizeof(unsigned long long)) > device.limit()) return;
    lights_ = DeviceBuffer<std::uint32_t>(device, entries);
    rays_ = DeviceBuffer<unsigned long long>(device, entries);
  }
  [[nodiscard]] RayMemory view() const { return {lights_.data(), rays_.data()}; }

 private:
  DeviceBuffer<std::uint32_t> lights_;
  DeviceBuffer<unsigned long long> rays_;
};

}  // namespace

void cut_by_packets(Device& device, const TracedScene& traced, const PixelView& pixels, const CutJob& job,
                    bool shadow_rays, const GroupList& list, const SumView& sums, const CutView& cuts) {
  if (shadow_rays) {
    const RememberedRaysBuffer remembered(device);
    const SeeByRays see{{traced.scene, traced.bvh}, remembered.view()};
    start_packets<false>(device, see, pixels, job, list, sums, cuts);
  } else if (cuts.listing.nodes != nullptr) {
    list_packets(device, pixels, job, list, sums, cuts);
  } else {
    start_packets<false>(device, SeeAll{}, pixels, job, list, sums, cuts);
  }
}

}  // namespace lightcuts::cuda
