#include "cuda/executor.cuh"
#include "cuda/packet_cut.cuh"
#include "cuda/packet_cut_by_maps.h"
#include "cuda/see_by_maps.cuh"

namespace lightcuts::cuda {

namespace {

struct LookUpTile {
  MapSetView maps;
  PixelView pixels;
  LightArrays lights;
  std::uint32_t first_slot;
  int kind;
  const std::uint32_t* ids;
  std::uint8_t* shares;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t light = ids[i / 32], slot = first_slot + i % 32;
    const Vec3 at = pixels.position[slot], ng = pixels.ng[slot];
    const float share = kind == vpl_kind     ? vpl_share(maps, light, at, ng)
                        : kind == point_kind ? point_share(maps, light, lights.points[light].cos_outer, at, ng)
                                             : directional_share(maps, light, at, ng);
    shares[i] = static_cast<std::uint8_t>(share * kShareSteps + 0.5f);
  }
};

}  // namespace

void look_up_tile(Device& device, const MapSetView& maps, const PixelView& pixels, const LightArrays& lights,
                  std::uint32_t tile, int kind, const std::uint32_t* ids, std::uint32_t count, std::uint8_t* shares) {
  CudaExecutor(device).for_each(32 * count, LookUpTile{maps, pixels, lights, tile * kTilePixels, kind, ids, shares});
}

void cut_by_packets(Device& device, const MapSetView& maps, const WantedMaps& wanted, const ShareTable& table,
                    const PixelView& pixels, const CutJob& job, const GroupList& list, const SumView& sums,
                    const CutView& cuts) {
  const auto start = [&](const auto& see) { start_packets<false>(device, see, pixels, job, list, sums, cuts); };
  if (cuts.listing.nodes != nullptr) {
    list_packets_by_maps(device, maps, wanted, pixels, job, list, sums, cuts);
  } else if (maps.depth_bits == 32) {
    start(SeeByMaps<std::uint32_t, 0>{maps, wanted, table});
  } else if (maps.size == 32) {
    start(SeeByMaps<std::uint16_t, 32>{maps, wanted, table});
  } else {
    start(SeeByMaps<std::uint16_t, 0>{maps, wanted, table});
  }
}

}  // namespace lightcuts::cuda
