#include "cuda/tile_order.h"

#include <cub/device/device_radix_sort.cuh>
#include <utility>

#include "cuda/executor.cuh"

namespace lightcuts::cuda {
namespace {

constexpr int kKeyBits = 4, kKeys = 1 << kKeyBits;
constexpr int kDearest = 8;  ///< leading zeros of a cost beyond which there is nothing to tell apart

/// Keys that are the smaller the dearer a tile is, a factor of two apart.
struct FindKeys {
  TileList list;
  const std::uint32_t* cost;
  std::uint8_t* keys;
  std::uint32_t* tiles;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t tile = list.tile(i);
    tiles[i] = tile;
    keys[i] = static_cast<std::uint8_t>(min_of(max_of(__clz(static_cast<int>(cost[tile])) - kDearest, 0), kKeys - 1));
  }
};

}  // namespace

void TileOrder::begin(Device& device, std::uint32_t tiles) {
  known_ = before_.size() == tiles ? before_.data() : nullptr;
  if (now_.size() != tiles) now_ = DeviceBuffer<std::uint32_t>(device, tiles);
  now_.fill_bytes(0);
}

void TileOrder::end() { std::swap(before_, now_); }

TileList TileOrder::sorted(Device& device, const TileList& list) {
  const std::uint32_t n = list.count;
  constexpr std::uint64_t needed = 16;  // bytes a tile: keys and tiles, both twice, and the sort's own
  if (known_ == nullptr || n < 2 || device.used() + needed * n > device.limit()) return list;
  DeviceBuffer<std::uint8_t> keys(device, n), sorted_keys(device, n);
  DeviceBuffer<std::uint32_t> tiles(device, n);
  if (tiles_.size() < n) tiles_ = DeviceBuffer<std::uint32_t>(device, n);
  CudaExecutor(device).for_each(n, FindKeys{list, known_, keys.data(), tiles.data()});
  std::size_t bytes = 0;
  const auto sort = [&](void* scratch) {
    return cub::DeviceRadixSort::SortPairs(scratch, bytes, keys.data(), sorted_keys.data(), tiles.data(), tiles_.data(),
                                           n, 0, kKeyBits, device.stream());
  };
  check(sort(nullptr), "planning an order of tiles");
  const DeviceBuffer<std::uint8_t> scratch(device, bytes);
  check(sort(scratch.data()), "ordering tiles");
  return {tiles_.data(), 0, n, list.missed};
}

}  // namespace lightcuts::cuda
