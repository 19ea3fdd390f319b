#include "cuda/group_order.h"

#include <cub/device/device_radix_sort.cuh>
#include <utility>

#include "cuda/executor.cuh"

namespace lightcuts::cuda {
namespace {

constexpr int kKeyBits = 4, kKeys = 1 << kKeyBits;
constexpr int kDearest = 8;  ///< leading zeros of a cost beyond which there is nothing to tell apart

/// Keys that are the smaller the dearer a group is, a factor of two apart.
struct FindKeys {
  GroupList list;
  const std::uint32_t* cost;
  std::uint8_t* keys;
  std::uint32_t* groups;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t group = list.groups[i];
    groups[i] = group;
    keys[i] = static_cast<std::uint8_t>(min_of(max_of(__clz(static_cast<int>(cost[group])) - kDearest, 0), kKeys - 1));
  }
};

}  // namespace

void GroupOrder::begin(Device& device, std::uint32_t tile_count) {
  const std::size_t groups = std::size_t{tile_count} * kTileGroups;
  known_ = before_.size() == groups ? before_.data() : nullptr;
  if (now_.size() != groups) now_ = DeviceBuffer<std::uint32_t>(device, groups);
  now_.fill_bytes(0);
}

void GroupOrder::end() { std::swap(before_, now_); }

GroupList GroupOrder::sorted(Device& device, const GroupList& list) {
  const std::uint32_t n = list.count;
  constexpr std::uint64_t needed = 16;  // bytes a group: keys and groups, both twice, and the sort's own
  if (known_ == nullptr || n < 2 || device.used() + needed * n > device.limit()) return list;
  DeviceBuffer<std::uint8_t> keys(device, n), sorted_keys(device, n);
  DeviceBuffer<std::uint32_t> groups(device, n);
  if (groups_.size() < n) groups_ = DeviceBuffer<std::uint32_t>(device, n);
  CudaExecutor(device).for_each(n, FindKeys{list, known_, keys.data(), groups.data()});
  std::size_t bytes = 0;
  const auto sort = [&](void* scratch) {
    return cub::DeviceRadixSort::SortPairs(scratch, bytes, keys.data(), sorted_keys.data(), groups.data(),
                                           groups_.data(), n, 0, kKeyBits, device.stream());
  };
  check(sort(nullptr), "planning an order of groups");
  const DeviceBuffer<std::uint8_t> scratch(device, bytes);
  check(sort(scratch.data()), "ordering groups");
  return {groups_.data(), n, list.missed};
}

}  // namespace lightcuts::cuda
