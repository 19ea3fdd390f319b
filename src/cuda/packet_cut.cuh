#pragma once

#include <algorithm>

#include "cuda/tile_cut.cuh"

namespace lightcuts::cuda {

inline constexpr int kCutThreads = 64, kCutBlocks = 10;
inline constexpr std::uint32_t kCutWarps = kCutThreads / 32;  ///< of a block
inline constexpr int kCrewResident = 2;                       ///< blocks of crews on a multiprocessor, at least
inline constexpr int kCrew = 4, kLargeCrew = 16;              ///< blocks

/// One warp a group; those that are too much for one are left.
/// @param taken  groups that were taken beyond the first of each warp
template <class Visibility, bool listing>
__global__ void __launch_bounds__(kCutThreads, kCutBlocks)
    packet_kernel(const __grid_constant__ Visibility visibility, PixelView pixels, CutJob job, GroupList list,
                  SumView sums, CutView cuts, std::uint32_t* taken) {
  __shared__ CutSpace<Visibility, 1> spaces[kCutWarps];
  const std::uint32_t warp = (blockIdx.x * kCutThreads + threadIdx.x) / 32, warps = gridDim.x * kCutWarps;
  for (std::uint32_t place = warp; place < list.count;) {
    const std::uint32_t group = list.groups[place];
    const bool remembers = cuts.lit_by != nullptr && !Visibility::asks;
    GroupRest rest;
    if (remembers && cuts.lit_by[group] != LitBy::warp) {
      rest.heavy = true;
    } else {
      TileCut<Visibility, listing> cut(job, visibility, cuts, spaces[threadIdx.x / 32],
                                       memory_of_warp(visibility, warp));
      rest = cut.run(pixels, sums, group, false);
    }
    if (threadIdx.x % 32 == 0) {
      if (rest.heavy) cuts.left.add({group, rest.missed});
      if (remembers && rest.heavy && !rest.missed) cuts.lit_by[group] = max_of(cuts.lit_by[group], LitBy::crew);
      if (rest.missed && !Visibility::asks) list.missed.add(group);
      place = warps + atomicAdd(taken, 1u);
    }
    place = __shfl_sync(kAllLanes, place, 0);
  }
}

/// Some blocks a group, for what packet_kernel or smaller crews left; all blocks must be resident at once.
/// @param queue           in which what is known to be too much is left as it is
/// @param board, arrivals  as class Meeting wants them, for each crew
template <class Visibility, bool listing>
__global__ void __launch_bounds__(kTeam * 32, kCrewResident)
    crew_kernel(const __grid_constant__ Visibility visibility, PixelView pixels, CutJob job, GroupQueue queue,
                MissedList missed, SumView sums, CutView cuts, int blocks, unsigned long long* board,
                unsigned* arrivals) {
  __shared__ CutSpace<Visibility, kTeam> space;
  const auto crew = blockIdx.x / static_cast<unsigned>(blocks), crews = gridDim.x / static_cast<unsigned>(blocks);
  Meeting meeting(board + crew * Meeting::board_words(static_cast<std::size_t>(blocks)), arrivals + crew, blocks,
                  static_cast<int>(blockIdx.x % static_cast<unsigned>(blocks)));
  const bool remembers = cuts.lit_by != nullptr && cuts.left.entries != nullptr && !Visibility::asks;
  const std::uint32_t count = *queue.count;
  for (std::uint32_t i = crew; i < count; i += crews) {
    const GroupQueue::Entry entry = queue.entries[i];
    GroupRest rest;
    if (remembers && cuts.lit_by[entry.group] == LitBy::large_crew) {
      rest.heavy = true;
    } else {
      TileCut<Visibility, listing, Crew::blocks> cut(job, visibility, cuts, space,
                                                     memory_of_block(visibility, blockIdx.x), &meeting);
      rest = cut.run(pixels, sums, entry.group, entry.missed);
    }
    if (meeting.rank() == 0 && threadIdx.x == 0) {
      if (rest.heavy) cuts.left.add({entry.group, entry.missed || rest.missed});
      if (remembers && rest.heavy && !rest.missed) cuts.lit_by[entry.group] = LitBy::large_crew;
      if (rest.missed && !entry.missed && !Visibility::asks) missed.add(entry.group);
    }
    __syncthreads();
  }
}

/// Starts the kernels for the groups of a list.
template <bool listing, class Visibility>
void start_packets(Device& device, const Visibility& see, const PixelView& pixels, const CutJob& job,
                   const GroupList& list, const SumView& sums, const CutView& cuts) {
  if (list.count == 0) return;
  const auto crew = crew_kernel<Visibility, listing>;
  const int multiprocessors = device.multiprocessors();
  int resident = 0;
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, crew, kTeam * 32, 0), "planning a cut");

  DeviceBuffer<GroupQueue::Entry> entries(device, 2 * std::size_t{list.count});
  DeviceBuffer<std::uint32_t> counts(device, 3);
  counts.fill_bytes(0);
  const GroupQueue for_crew{entries.data(), counts.data()},
      for_large_crew{entries.data() + list.count, counts.data() + 1};
  CutView view = cuts;
  if (resident > 0) view.left = for_crew;
  // Where each warp has memory, only as many as can run at the same time are started.
  std::uint32_t starting = (list.count + kCutWarps - 1) / kCutWarps;
  if (Visibility::traces) starting = std::min(starting, static_cast<std::uint32_t>(kCutBlocks * multiprocessors));
  packet_kernel<Visibility, listing>
      <<<starting, kCutThreads, 0, device.stream()>>>(see, pixels, job, list, sums, view, counts.data() + 2);
  check(cudaGetLastError(), "cutting light trees");

  if (resident == 0) return;
  const int at_once = std::min(resident, kCrewResident) * multiprocessors;
  const auto start_crews = [&](int blocks, GroupQueue queue, const GroupQueue& left) {
    blocks = std::min(blocks, at_once);
    const int crews = at_once / blocks;
    DeviceBuffer<unsigned long long> board(device, crews * Meeting::board_words(static_cast<std::size_t>(blocks)));
    DeviceBuffer<unsigned> arrivals(device, static_cast<std::size_t>(crews));
    arrivals.fill_bytes(0);
    unsigned long long* boards = board.data();
    unsigned* arrived = arrivals.data();
    view.left = left;
    Visibility seen = see;
    PixelView pixel_view = pixels;
    CutJob crew_job = job;
    crew_job.work.most = job.work.crew;
    MissedList missed = list.missed;
    SumView sum_view = sums;
    void* arguments[] = {&seen, &pixel_view, &crew_job, &queue, &missed, &sum_view, &view, &blocks, &boards, &arrived};
    check(cudaLaunchCooperativeKernel(crew, dim3(static_cast<unsigned>(crews * blocks)), dim3(kTeam * 32), arguments, 0,
                                      device.stream()),
          "cutting light trees");
  };
  start_crews(kCrew, for_crew, for_large_crew);
  start_crews(kLargeCrew, for_large_crew, {});
}

/// As cut_by_packets without shadow rays, and lists the nodes: for tests.
void list_packets(Device& device, const PixelView& pixels, const CutJob& job, const GroupList& list,
                  const SumView& sums, const CutView& cuts);

}  // namespace lightcuts::cuda
