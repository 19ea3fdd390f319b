#include "cuda/light_maps.h"

#include <algorithm>

#include "cuda/executor.cuh"
#include "cuda/light_by_maps.h"

namespace lightcuts::cuda {
namespace {

/// Maps that there is memory for from the start; more is taken when it is needed.
constexpr std::uint32_t kFirstRoom = kFewLights;

std::uint32_t light_count(const LightArrays& lights, int kind) {
  return kind == vpl_kind ? lights.vpl_count : kind == point_kind ? lights.point_count : lights.directional_count;
}
std::uint32_t words_for(std::uint32_t lights) { return (lights + 31) / 32; }

const std::uint32_t* slots_of(const MapSetView& view, int kind) {
  return kind == vpl_kind ? view.vpl_slots : kind == point_kind ? view.point_slots : view.directional_slots;
}

struct WantUpperLevel {
  const StagedLight* frontier;
  const std::uint32_t* slots;
  WantedMaps wanted;
  int kind;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t light = frontier[i].light;
    if (slots[light] == kNone) wanted.mark(kind, light);
  }
};

struct WantMissing {
  const std::uint32_t* slots;
  WantedMaps wanted;
  int kind;
  __device__ void operator()(std::uint32_t light) const {
    if (slots[light] == kNone) wanted.mark(kind, light);
  }
};

struct CountBits {
  const std::uint32_t* words;
  std::uint32_t* counts;
  __device__ void operator()(std::uint32_t i) const { counts[i] = static_cast<std::uint32_t>(__popc(words[i])); }
};

/// The numbers of the bits that are set, in order.
struct ListBits {
  const std::uint32_t* words;
  const std::uint32_t* places;
  std::uint32_t* ids;
  __device__ void operator()(std::uint32_t i) const {
    std::uint32_t at = places[i];
    for (std::uint32_t word = words[i]; word != 0; word &= word - 1) {
      ids[at++] = 32 * i + static_cast<std::uint32_t>(__ffs(static_cast<int>(word)) - 1);
    }
  }
};

}  // namespace

std::uint64_t LightMaps::fixed_bytes(const Device& device, const MapOptions& options, const LightArrays& lights) {
  const std::uint64_t count = std::uint64_t{lights.vpl_count} + lights.point_count + lights.directional_count;
  // A bit a light and two numbers for each 32 lights; their list may name all lights.
  return DeviceMaps::fixed_bytes(device, options, lights) + count / 8 + count / 4 + 4 * count;
}

LightMaps::LightMaps(Device& device, const DevicePoints& points, const MapOptions& options, const LightArrays& lights,
                     std::uint64_t budget)
    : device_(&device), points_(&points), options_(options), lights_(lights), budget_(budget) {
  room_ = plan_room(budget);
  maps_.emplace(device, options, lights, std::min(room_, kFirstRoom));
  for (int kind = 0; kind < kKinds; ++kind) {
    wanted_[kind] = DeviceBuffer<std::uint32_t>(device, words_for(light_count(lights, kind)));
    wanted_[kind].fill_bytes(0);
  }
}

std::uint32_t LightMaps::plan_room(std::uint64_t budget) const {
  return plan_maps_at_once(budget, fixed_bytes(*device_, options_, lights_), DeviceMaps::bytes_per_map(options_),
                           most_maps(lights_), options_.size);
}

/// Whether all maps are drawn sooner than it is known which are wanted.
bool LightMaps::is_few() const {
  const auto work = [](std::uint64_t maps, int size, std::uint32_t points) {
    return maps * (static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size) + points);
  };
  return work(most_maps(lights_), options_.size, points_->view().per_map) <= work(kFewLights, 32, 2000);
}

std::uint64_t LightMaps::taken_bytes() const {
  return maps_->taken_bytes() + wanted_[0].bytes() + wanted_[1].bytes() + wanted_[2].bytes();
}

void LightMaps::report(Statistics& statistics) const {
  statistics.shadow_maps.size = options_.size;
  statistics.shadow_maps.room = room_;
  statistics.shadow_maps.bytes = bytes();
}

bool LightMaps::set_budget(std::uint64_t budget) {
  const std::uint64_t needed =
      fixed_bytes(*device_, options_, lights_) + maps_->capacity() * DeviceMaps::bytes_per_map(options_);
  if (budget < needed) return false;
  budget_ = budget;
  room_ = plan_room(budget);
  return true;
}

WantedMaps LightMaps::wanted() { return {{wanted_[0].data(), wanted_[1].data(), wanted_[2].data()}}; }

void LightMaps::want_upper_levels(const TreeViews& trees) {
  CudaExecutor executor(*device_);
  for (int kind = 0; kind < kKinds; ++kind) {
    const TreeView& tree = trees.kind[kind];
    executor.for_each(tree.frontier_count, WantUpperLevel{tree.frontier, slots_of(view(), kind), wanted(), kind});
  }
}

void LightMaps::want_all() {
  CudaExecutor executor(*device_);
  for (int kind = 0; kind < kKinds; ++kind) {
    executor.for_each(light_count(lights_, kind), WantMissing{slots_of(view(), kind), wanted(), kind});
  }
}

bool LightMaps::add_first(const TreeViews& trees) {
  if (has_first_) return true;
  has_all_ = is_few() && most_maps(lights_) <= room_;
  has_all_ ? want_all() : want_upper_levels(trees);
  const bool none = maps_->count() == 0;
  has_first_ = add_wanted();
  if (none) first_maps_ = maps_->count();
  return has_first_;
}

void LightMaps::replace_lights(const LightArrays& lights) {
  lights_ = lights;
  dead_ += maps_->replace_lights(lights);
  has_first_ = false;
  if (2 * dead_ <= maps_->count()) return;
  maps_->clear();
  dead_ = first_maps_ = 0;
}

void LightMaps::clear() {
  has_first_ = false;
  dead_ = first_maps_ = 0;
  // Once there was too little room, all that there may be is taken.
  maps_->capacity() < room_ ? maps_->renew(room_) : maps_->clear();
}

/// Makes sure that there is memory for so many maps more; false where that is more than there may be.
bool LightMaps::make_room(std::uint64_t maps) {
  const std::uint64_t needed = maps_->count() + maps, capacity = maps_->capacity();
  if (needed <= capacity) return true;
  if (needed > room_) return false;
  const auto wanted = static_cast<std::uint32_t>(std::min<std::uint64_t>(room_, std::max(needed, 2 * capacity)));
  if (maps_->count() == 0) {
    maps_->renew(wanted);
    return true;
  }
  // Both the old and the new memory are taken while maps are copied.
  const std::uint64_t both =
      fixed_bytes(*device_, options_, lights_) + (capacity + wanted) * DeviceMaps::bytes_per_map(options_);
  if (both > budget_) return false;
  maps_->grow(wanted);
  return true;
}

/// Lists the lights that are wanted, and forgets the wishes.
std::uint32_t LightMaps::list_wanted(int kind, DeviceBuffer<std::uint32_t>& ids) {
  const auto words = static_cast<std::uint32_t>(wanted_[kind].size());
  if (words == 0) return 0;
  CudaExecutor executor(*device_);
  DeviceBuffer<std::uint32_t> counts(*device_, words), places(*device_, words);
  executor.for_each(words, CountBits{wanted_[kind].data(), counts.data()});
  const std::uint32_t found = executor.exclusive_scan(counts.data(), places.data(), words);
  if (found == 0) return 0;
  ids = DeviceBuffer<std::uint32_t>(*device_, found);
  executor.for_each(words, ListBits{wanted_[kind].data(), places.data(), ids.data()});
  wanted_[kind].fill_bytes(0);
  return found;
}

bool LightMaps::add_wanted() {
  StageTimer timer(*device_, "shadow maps");
  DeviceBuffer<std::uint32_t> ids[kKinds];
  std::uint32_t found[kKinds] = {};
  std::uint64_t maps = 0;
  for (int kind = 0; kind < kKinds; ++kind) {
    found[kind] = list_wanted(kind, ids[kind]);
    maps += std::uint64_t{found[kind]} * (kind == point_kind ? 2 : 1);
  }
  if (!make_room(maps)) return false;
  const std::uint32_t before = maps_->count();
  maps_->add_vpls(points_->view(), {ids[vpl_kind].data(), 0, found[vpl_kind]});
  maps_->add_points(points_->view(), {ids[point_kind].data(), 0, found[point_kind]});
  maps_->add_directionals(points_->view(), {ids[directional_kind].data(), 0, found[directional_kind]});
  made_ += maps_->count() - before;
  most_ = std::max(most_, maps_->count());
  milliseconds_ += timer.ms();
  return true;
}

namespace {

struct WriteRows {
  const std::uint32_t* ids;
  std::uint32_t first;
  std::uint32_t* rows;
  __device__ void operator()(std::uint32_t i) const { rows[ids[i]] = first + i; }
};

}  // namespace

void LightMaps::look_up_wanted(const TreeViews& trees, const FillShares& fill) {
  CudaExecutor executor(*device_);
  const std::size_t counts[] = {lights_.vpl_count, lights_.point_count, lights_.directional_count};
  if (rows_.empty()) {
    rows_ = DeviceBuffer<std::uint32_t>(*device_, counts[0] + counts[1] + counts[2]);
    rows_.fill_bytes(0xff);
    maps_->clear();
    has_first_ = false;
    dead_ = first_maps_ = 0;
    want_upper_levels(trees);
  }
  std::uint32_t* const rows[] = {rows_.data(), rows_.data() + counts[0], rows_.data() + counts[0] + counts[1]};
  for (int kind = 0; kind < kKinds; ++kind) {
    DeviceBuffer<std::uint32_t> ids;
    const std::uint32_t found = list_wanted(kind, ids);
    if (found == 0) continue;
    DeviceBuffer<std::uint8_t> larger(*device_, std::size_t{32} * (row_count_ + found));
    check(cudaMemcpyAsync(larger.data(), shares_.data(), std::size_t{32} * row_count_, cudaMemcpyDeviceToDevice,
                          device_->stream()),
          "copying what arrives of lights");
    shares_ = std::move(larger);
    const std::uint32_t at_once = std::max(1u, maps_->capacity() / (kind == point_kind ? 2 : 1));
    for (std::uint32_t first = 0; first < found; first += at_once) {
      const LightRange range{ids.data() + first, 0, std::min(at_once, found - first)};
      maps_->clear();
      if (kind == vpl_kind) maps_->add_vpls(points_->view(), range);
      if (kind == point_kind) maps_->add_points(points_->view(), range);
      if (kind == directional_kind) maps_->add_directionals(points_->view(), range);
      made_ += maps_->count();
      most_ = std::max(most_, maps_->count());
      fill(range.ids, range.count, kind, shares_.data() + std::size_t{32} * (row_count_ + first));
    }
    executor.for_each(found, WriteRows{ids.data(), row_count_, rows[kind]});
    row_count_ += found;
  }
  maps_->clear();
  table_ = {{rows[0], rows[1], rows[2]}, shares_.data()};
}

void LightMaps::forget_table() {
  rows_ = {};
  shares_ = {};
  row_count_ = 0;
  table_ = {};
}

}  // namespace lightcuts::cuda
