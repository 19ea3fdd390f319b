#pragma once

#include "cuda/tile_cut.cuh"

namespace lightcuts::cuda {

inline constexpr int kCutThreads = 64, kCutBlocks = 10;
inline constexpr int kTeam = 16;      ///< warps for a tile that is too much for one, or
inline constexpr int kSmallTeam = 4;  ///< where shared memory is scarce
static_assert(kTreeParts % (32 * kTeam) == 0 && kTreeParts % (32 * kSmallTeam) == 0);

/// One warp a tile; tiles that are too much for one are left, by their places in the list.
template <class Visibility, bool listing>
__global__ void __launch_bounds__(kCutThreads, kCutBlocks)
    packet_kernel(Visibility visibility, PixelView pixels, CutJob job, TileList list, SumView sums, CutView cuts) {
  __shared__ WarpSpace<Visibility> spaces[kCutThreads / 32];
  const std::uint32_t place = (blockIdx.x * kCutThreads + threadIdx.x) / 32;
  if (place >= list.count) return;
  const std::uint32_t tile = list.tile(place);
  const TileOutcome outcome = TileCut<Visibility, listing>(job, visibility, cuts, spaces)
                                  .run(pixels, sums, tile * kTilePixels + threadIdx.x % 32);
  if (threadIdx.x % 32 != 0) return;
  if (outcome == TileOutcome::heavy) cuts.heavy[atomicAdd(cuts.heavy_count, 1u)] = tile;
  if (outcome == TileOutcome::missed) list.missed.add(tile);
}

/// One block a tile, for those that packet_kernel left.
template <class Visibility, bool listing>
__global__ void __launch_bounds__(kTeam * 32)
    team_kernel(Visibility visibility, PixelView pixels, CutJob job, TileList list, SumView sums, CutView cuts) {
  extern __shared__ __align__(16) unsigned char shared[];
  auto* const spaces = reinterpret_cast<WarpSpace<Visibility>*>(shared);
  const std::uint32_t count = *cuts.heavy_count;
  for (std::uint32_t i = blockIdx.x; i < count; i += gridDim.x) {
    const std::uint32_t tile = cuts.heavy[i];
    const TileOutcome outcome = TileCut<Visibility, listing, true>(job, visibility, cuts, spaces)
                                    .run(pixels, sums, tile * kTilePixels + threadIdx.x % 32);
    if (threadIdx.x == 0 && outcome == TileOutcome::missed) list.missed.add(tile);
    __syncthreads();
  }
}

/// Starts both kernels for the tiles of a list.
template <bool listing, class Visibility>
void start_packets(Device& device, const Visibility& see, const PixelView& pixels, const CutJob& job,
                   const TileList& list, const SumView& sums, const CutView& cuts) {
  if (list.count == 0) return;
  constexpr std::uint32_t warps = kCutThreads / 32;
  const std::uint32_t blocks = (list.count + warps - 1) / warps;
  DeviceBuffer<std::uint32_t> heavy(device, list.count), heavy_count(device, 1);
  heavy_count.fill_bytes(0);
  CutView view = cuts;
  view.heavy = heavy.data();
  view.heavy_count = heavy_count.data();
  packet_kernel<Visibility, listing><<<blocks, kCutThreads, 0, device.stream()>>>(see, pixels, job, list, sums, view);
  check(cudaGetLastError(), "cutting light trees");
  const auto team = team_kernel<Visibility, listing>;
  constexpr int each = static_cast<int>(sizeof(WarpSpace<Visibility>));
  const int warps_of_team = kTeam * each <= device.shared_memory() ? kTeam : kSmallTeam, bytes = warps_of_team * each;
  check(cudaFuncSetAttribute(team, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes), "setting up a kernel");
  const auto grid = static_cast<unsigned>(2 * device.multiprocessors());
  team<<<grid, warps_of_team * 32, bytes, device.stream()>>>(see, pixels, job, list, sums, view);
  check(cudaGetLastError(), "cutting light trees");
}

/// As cut_by_packets without shadow rays, and lists the nodes: for tests.
void list_packets(Device& device, const PixelView& pixels, const CutJob& job, const TileList& list, const SumView& sums,
                  const CutView& cuts);

}  // namespace lightcuts::cuda
