#pragma once

#include <algorithm>

#include "cuda/tile_cut.cuh"

namespace lightcuts::cuda {

inline constexpr int kCutThreads = 64, kCutBlocks = 10;
inline constexpr int kTeamBlocks = 2;  ///< of kTeam warps at least, on a multiprocessor
inline constexpr int kCrewBlocks = 8;  ///< blocks for a tile that is too much for one

/// One warp a tile; tiles that are too much for one are left.
template <class Visibility, bool listing>
__global__ void __launch_bounds__(kCutThreads, kCutBlocks)
    packet_kernel(const __grid_constant__ Visibility visibility, PixelView pixels, CutJob job, TileList list,
                  SumView sums, CutView cuts) {
  __shared__ CutSpace<Visibility, 1> spaces[kCutThreads / 32];
  const std::uint32_t place = (blockIdx.x * kCutThreads + threadIdx.x) / 32;
  if (place >= list.count) return;
  const std::uint32_t tile = list.tile(place);
  TileCut<Visibility, listing> cut(job, visibility, cuts, spaces[threadIdx.x / 32]);
  const TileOutcome outcome = cut.run(pixels, sums, tile * kTilePixels + threadIdx.x % 32, false);
  if (threadIdx.x % 32 != 0) return;
  if (outcome == TileOutcome::heavy) cuts.left.add(tile, cut.missed());
  if (outcome == TileOutcome::missed) list.missed.add(tile);
}

/// One block a tile, for those that packet_kernel left.
template <class Visibility, bool listing>
__global__ void __launch_bounds__(kTeam * 32, kTeamBlocks)
    team_kernel(const __grid_constant__ Visibility visibility, PixelView pixels, CutJob job, TileQueue queue,
                MissedList missed, SumView sums, CutView cuts) {
  __shared__ CutSpace<Visibility, kTeam> space;
  __shared__ std::uint32_t next;
  while (true) {
    if (threadIdx.x == 0) next = atomicAdd(&queue.counts[1], 1u);
    __syncthreads();
    if (next >= queue.counts[0]) return;
    const std::uint32_t entry = queue.tiles[next], tile = entry & ~TileQueue::kMissed;
    TileCut<Visibility, listing, Crew::block> cut(job, visibility, cuts, space);
    const TileOutcome outcome =
        cut.run(pixels, sums, tile * kTilePixels + threadIdx.x % 32, (entry & TileQueue::kMissed) != 0);
    if (threadIdx.x == 0 && outcome == TileOutcome::heavy) cuts.left.add(tile, cut.missed());
    if (threadIdx.x == 0 && outcome == TileOutcome::missed) missed.add(tile);
    __syncthreads();
  }
}

/// Some blocks a tile, for those that team_kernel left; all blocks must be resident at once.
/// @param board, arrivals  as class Meeting wants them, for each crew
template <class Visibility, bool listing>
__global__ void __launch_bounds__(kTeam * 32, kTeamBlocks)
    crew_kernel(const __grid_constant__ Visibility visibility, PixelView pixels, CutJob job, TileQueue queue,
                MissedList missed, SumView sums, CutView cuts, int blocks, unsigned long long* board,
                unsigned* arrivals) {
  __shared__ CutSpace<Visibility, kTeam> space;
  const auto crew = blockIdx.x / static_cast<unsigned>(blocks), crews = gridDim.x / static_cast<unsigned>(blocks);
  Meeting meeting(board + crew * Meeting::board_words(static_cast<std::size_t>(blocks)), arrivals + crew, blocks,
                  static_cast<int>(blockIdx.x % static_cast<unsigned>(blocks)));
  const std::uint32_t count = queue.counts[0];
  for (std::uint32_t i = crew; i < count; i += crews) {
    const std::uint32_t entry = queue.tiles[i], tile = entry & ~TileQueue::kMissed;
    const TileOutcome outcome =
        TileCut<Visibility, listing, Crew::blocks>(job, visibility, cuts, space, &meeting)
            .run(pixels, sums, tile * kTilePixels + threadIdx.x % 32, (entry & TileQueue::kMissed) != 0);
    if (meeting.rank() == 0 && threadIdx.x == 0 && outcome == TileOutcome::missed) missed.add(tile);
    __syncthreads();
  }
}

/// Starts the kernels for the tiles of a list.
template <bool listing, class Visibility>
void start_packets(Device& device, const Visibility& see, const PixelView& pixels, const CutJob& job,
                   const TileList& list, const SumView& sums, const CutView& cuts) {
  if (list.count == 0) return;
  constexpr std::uint32_t warps = kCutThreads / 32;
  DeviceBuffer<std::uint32_t> left(device, 2 * std::size_t{list.count}), counts(device, 4);
  counts.fill_bytes(0);
  TileQueue for_blocks{left.data(), counts.data()}, for_crews{left.data() + list.count, counts.data() + 2};
  CutView view = cuts;
  view.left = for_blocks;
  packet_kernel<Visibility, listing>
      <<<(list.count + warps - 1) / warps, kCutThreads, 0, device.stream()>>>(see, pixels, job, list, sums, view);
  check(cudaGetLastError(), "cutting light trees");

  const auto crew = crew_kernel<Visibility, listing>;
  const int multiprocessors = device.multiprocessors();
  int resident = 0;
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, crew, kTeam * 32, 0), "planning a cut");
  view.left = resident > 0 ? for_crews : TileQueue{};
  team_kernel<Visibility, listing>
      <<<static_cast<unsigned>(kTeamBlocks * multiprocessors), kTeam * 32, 0, device.stream()>>>(
          see, pixels, job, for_blocks, list.missed, sums, view);
  check(cudaGetLastError(), "cutting light trees");

  if (resident == 0) return;
  const int at_once = std::min(resident, kTeamBlocks) * multiprocessors;
  int blocks = std::min(kCrewBlocks, at_once);
  const int crews = at_once / blocks;
  DeviceBuffer<unsigned long long> board(device, crews * Meeting::board_words(static_cast<std::size_t>(blocks)));
  DeviceBuffer<unsigned> arrivals(device, static_cast<std::size_t>(crews));
  arrivals.fill_bytes(0);
  unsigned long long* boards = board.data();
  unsigned* arrived = arrivals.data();
  Visibility seen = see;
  PixelView pixel_view = pixels;
  CutJob cut_job = job;
  MissedList missed = list.missed;
  SumView sum_view = sums;
  void* arguments[] = {&seen, &pixel_view, &cut_job, &for_crews, &missed, &sum_view, &view, &blocks, &boards, &arrived};
  check(cudaLaunchCooperativeKernel(crew, dim3(static_cast<unsigned>(crews * blocks)), dim3(kTeam * 32), arguments, 0,
                                    device.stream()),
        "cutting light trees");
}

/// As cut_by_packets without shadow rays, and lists the nodes: for tests.
void list_packets(Device& device, const PixelView& pixels, const CutJob& job, const TileList& list, const SumView& sums,
                  const CutView& cuts);

}  // namespace lightcuts::cuda
