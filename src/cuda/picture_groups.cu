#include "cuda/picture_groups.h"

#include "cuda/warp.cuh"

namespace lightcuts::cuda {
namespace {

constexpr int kThreads = 512;

/// Of the waiting pixels of a tile, one a lane, those on the same surface as the first.
__device__ unsigned like_first(unsigned waiting, Vec3 position, Vec3 normal) {
  const int leader = __ffs(static_cast<int>(waiting)) - 1;
  const Vec3 of_leader = from_lane(normal, leader), way = position - from_lane(position, leader);
  const float off = fabsf(dot(of_leader, way));
  const bool alike = dot(of_leader, normal) > 0.9f && off * off <= 0.1f * dot(way, way) + 1e-12f;
  return (__ballot_sync(kAllLanes, alike) | 1u << leader) & waiting;
}

/// A warp a tile: those like its first pixel, those like the first of the others, and so on; the last group is whatever
/// is left, however scattered. Which block lists its groups first is up to the device, and does not matter.
__global__ void __launch_bounds__(kThreads)
    find_groups(PixelView pixels, std::uint32_t tile_count, std::uint32_t* group_pixels, std::uint32_t* list,
                std::uint32_t* count) {
  __shared__ std::uint32_t upto[kThreads / 32], first;
  const std::uint32_t warp = threadIdx.x / 32, lane = threadIdx.x % 32, tile = blockIdx.x * (kThreads / 32) + warp;
  std::uint32_t found = 0;
  if (tile < tile_count) {
    const std::uint32_t slot = tile * kTilePixels + lane;
    const Vec3 normal = pixels.ns[slot], position = pixels.position[slot];
    unsigned waiting = __ballot_sync(kAllLanes, !(normal == Vec3{})), own = 0;
    for (std::uint32_t number = 0; number < kTileGroups; ++number) {
      const bool last = waiting == 0 || number + 1 == kTileGroups;
      const unsigned group = last ? waiting : like_first(waiting, position, normal);
      waiting &= ~group;
      if (lane == number) own = group;
      if (group != 0 || number == 0) ++found;
    }
    if (lane < kTileGroups) group_pixels[tile * kTileGroups + lane] = own;
  }
  if (lane == 0) upto[warp] = found;
  __syncthreads();
  if (threadIdx.x == 0) {
    std::uint32_t sum = 0;
    for (std::uint32_t& of_warp : upto) {
      const std::uint32_t own = of_warp;
      of_warp = sum;
      sum += own;
    }
    first = atomicAdd(count, sum);
  }
  __syncthreads();
  if (lane < found) list[first + upto[warp] + lane] = tile * kTileGroups + lane;
}

}  // namespace

PictureGroups::PictureGroups(Device& device, const PixelView& pixels, std::uint32_t tile_count)
    : pixels_(device, std::size_t{tile_count} * kTileGroups), list_(device, std::size_t{tile_count} * kTileGroups) {
  if (tile_count == 0) return;
  DeviceBuffer<std::uint32_t> count(device, 1);
  count.fill_bytes(0);
  constexpr std::uint32_t tiles_of_block = kThreads / 32;
  find_groups<<<(tile_count + tiles_of_block - 1) / tiles_of_block, kThreads, 0, device.stream()>>>(
      pixels, tile_count, pixels_.data(), list_.data(), count.data());
  check(cudaGetLastError(), "finding groups of pixels");
  count.download(&count_, 1);
  device.synchronize();
}

}  // namespace lightcuts::cuda
