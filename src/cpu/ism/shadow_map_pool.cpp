#include "cpu/ism/shadow_map_pool.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "math/sample_stream.h"

namespace lightcuts {
namespace {

/// Words that stand for no map: the light has none; a thread is making it.
constexpr std::uint32_t kMissing = kNone, kInWork = kNone - 1;

constexpr std::uint64_t kNobody = ~std::uint64_t{0};

std::uint64_t name_of(LightKind kind, std::uint32_t light, int which) {
  return std::uint64_t{light} << 8 | static_cast<std::uint64_t>(kind) << 1 | static_cast<std::uint64_t>(which);
}

}  // namespace

ShadowMapPool::ShadowMapPool(const MapMaker& maker, std::size_t room, int threads)
    : maker_(maker), room_(room), threads_(static_cast<std::size_t>(threads)) {
  const LightSet& lights = maker.lights();
  const std::size_t counts[3] = {lights.vpls.size(), lights.points.size(), lights.directionals.size()};
  for (std::size_t kind = 0; kind < 3; ++kind) slots_[kind] = std::make_unique<Slot[]>(counts[kind]);
  chunks_.resize((room + kChunk - 1) / kChunk);
  chunk_there_ = std::make_unique<std::atomic<bool>[]>(chunks_.size());
  clear();
}

void ShadowMapPool::clear() {
  const LightSet& lights = maker_.lights();
  const std::size_t counts[3] = {lights.vpls.size(), lights.points.size(), lights.directionals.size()};
  for (std::size_t kind = 0; kind < 3; ++kind) {
    for (std::size_t i = 0; i < counts[kind]; ++i) slots_[kind][i].store(kMissing, std::memory_order_relaxed);
  }
  most_ = most();
  taken_ = 0;
  lost_ = 0;
  free_.clear();
  free_taken_ = 0;
}

void ShadowMapPool::forget(const LightIds& ids) {
  free_.erase(free_.begin(), free_.begin() + static_cast<std::ptrdiff_t>(std::min(free_taken_.load(), free_.size())));
  free_taken_ = 0;
  const auto forget_those = [this](LightKind kind, const std::vector<std::uint32_t>& lights) {
    for (const std::uint32_t light : lights) {
      Slot& slot = slot_of(kind, light);
      const std::uint32_t place = slot.load(std::memory_order_relaxed);
      if (place == kMissing) continue;
      if (kind == LightKind::point) {
        lost_ += 2;  // the light has changed: whether it had two maps is not known any more
      } else {
        free_.push_back(place);
      }
      slot.store(kMissing, std::memory_order_relaxed);
    }
  };
  forget_those(LightKind::vpl, ids.vpls);
  forget_those(LightKind::point, ids.points);
  forget_those(LightKind::directional, ids.directionals);
  if (2 * lost_ > taken_.load()) clear();
}

bool ShadowMapPool::change_room(std::size_t room) {
  if (room == room_) return true;
  // The last chunk may have been made for fewer maps than the others.
  const bool whole = room_ % kChunk == 0 || !chunk_there_[room_ / kChunk].load();
  if (!whole || divided_ || taken_.load() > room) return false;
  const std::size_t count = (room + kChunk - 1) / kChunk;
  auto there = std::make_unique<std::atomic<bool>[]>(count);
  for (std::size_t i = 0; i < std::min(count, chunks_.size()); ++i) there[i] = chunk_there_[i].load();
  if (room % kChunk != 0 && room < room_ && there[count - 1].load()) return false;
  chunks_.resize(count);
  chunk_there_ = std::move(there);
  room_ = room;
  return true;
}

void ShadowMapPool::begin_picture() {
  if (divided_) clear();
  divided_ = false;
  most_ = 0;
  made_ = 0;
  making_ns_ = 0;
}

std::uint64_t ShadowMapPool::bytes() const {
  std::uint64_t maps = 0;
  for (std::size_t i = 0; i < chunks_.size(); ++i) {
    if (chunk_there_[i].load()) maps += std::min(kChunk, room_ - i * kChunk);
  }
  return maps * MapBlocks::stride(maker_.options());
}

std::size_t ShadowMapPool::most() const { return divided_ ? room_ : std::max(most_, std::min(taken_.load(), room_)); }

void ShadowMapPool::divide() {
  clear();
  divided_ = true;
  owner_.assign(room_, kNobody);
}

ShadowMapPool::Place ShadowMapPool::place_of(std::size_t map) const {
  const std::size_t chunk = map / kChunk;
  if (!chunk_there_[chunk].load(std::memory_order_acquire)) {
    const std::lock_guard lock(chunk_mutex_);
    if (!chunk_there_[chunk].load(std::memory_order_relaxed)) {
      chunks_[chunk] = MapBlocks(maker_.options(), std::min(kChunk, room_ - chunk * kChunk));
      chunk_there_[chunk].store(true, std::memory_order_release);
    }
  }
  return {&chunks_[chunk], map % kChunk};
}

void ShadowMapPool::make(LightKind kind, std::uint32_t light, int which, Place place) const {
  const auto start = std::chrono::steady_clock::now();
  place.blocks->make(maker_, kind, light, which, place.at);
  const auto took = std::chrono::steady_clock::now() - start;
  making_ns_.fetch_add(static_cast<std::uint64_t>(std::chrono::nanoseconds(took).count()), std::memory_order_relaxed);
  made_.fetch_add(1, std::memory_order_relaxed);
}

std::uint32_t ShadowMapPool::take(int count) const {
  if (count == 1 && free_taken_.load(std::memory_order_relaxed) < free_.size()) {
    const std::size_t next = free_taken_.fetch_add(1, std::memory_order_relaxed);
    if (next < free_.size()) return free_[next];
  }
  const std::size_t first = taken_.fetch_add(static_cast<std::size_t>(count), std::memory_order_relaxed);
  if (first + static_cast<std::size_t>(count) > room_) return kMissing;
  return static_cast<std::uint32_t>(first);
}

std::uint32_t ShadowMapPool::obtain(LightKind kind, std::uint32_t light, Slot& slot) const {
  for (;;) {
    std::uint32_t found = kMissing;
    if (slot.compare_exchange_strong(found, kInWork, std::memory_order_acquire)) break;
    if (found != kInWork) return found;
    slot.wait(kInWork, std::memory_order_acquire);
  }
  const int count = maker_.maps_for(kind, light);
  const std::uint32_t first = take(count);
  if (first != kMissing) {
    for (int which = 0; which < count; ++which) {
      make(kind, light, which, place_of(first + static_cast<std::size_t>(which)));
    }
  }
  slot.store(first, std::memory_order_release);
  slot.notify_all();
  if (first == kMissing) throw PoolIsFull{};
  return first;
}

/// The calling thread's own map of a light, in the one place of its part where it may be.
ShadowMapPool::Place ShadowMapPool::own_map(LightKind kind, std::uint32_t light, int which) const {
  const std::size_t part = room_ / threads_;
  const auto thread = static_cast<std::size_t>(std::max(0, tbb::this_task_arena::current_thread_index())) % threads_;
  const std::uint64_t name = name_of(kind, light, which);
  const std::uint32_t mixed =
      combine_bits(light, static_cast<std::uint32_t>(kind) * 2 + static_cast<std::uint32_t>(which));
  const std::size_t map = thread * part + static_cast<std::size_t>((std::uint64_t{mixed} * part) >> 32);
  const Place place = place_of(map);
  if (owner_[map] != name) {
    make(kind, light, which, place);
    owner_[map] = name;
  }
  return place;
}

std::uint32_t ShadowMapPool::first_map(LightKind kind, std::uint32_t light) const {
  Slot& slot = slot_of(kind, light);
  const std::uint32_t first = slot.load(std::memory_order_acquire);
  return first < kInWork ? first : obtain(kind, light, slot);
}

void ShadowMapPool::group_shares(const FlatReceivers& receivers, std::span<const std::uint32_t> vpls,
                                 float* share) const {
  GroupMap maps[kPacketSize];
  if (divided_) {  // a map may take the place of the one before
    for (std::size_t i = 0; i < vpls.size(); ++i) {
      const Place place = own_map(LightKind::vpl, vpls[i], 0);
      maps[0] = {place.blocks->record(place.at), place.blocks->codes(place.at)};
      alignas(64) float one[kPacketSize];  // whole packets are written
      maker_.look_up_group(receivers, maps, 1, one);
      share[i] = one[0];
    }
    return;
  }
  for (std::size_t i = 0; i < vpls.size(); ++i) {
    const Place place = place_of(first_map(LightKind::vpl, vpls[i]));
    maps[i] = {place.blocks->record(place.at), place.blocks->codes(place.at)};
  }
  maker_.look_up_group(receivers, maps, static_cast<int>(vpls.size()), share);
}

std::uint32_t ShadowMapPool::shares(const VisibilityQuery& query, float* share) const {
  const LightKind kind = query.kind;
  if (query.candidates == 0) {
    std::fill_n(share, kPacketSize, 0.0f);
    return 0;
  }
  const int count = maker_.maps_for(kind, query.light);
  if (divided_) {
    look_up_light(maker_, count, query.receivers, query.candidates, share, [&](int which) {
      const Place place = own_map(kind, query.light, which);
      return std::pair{place.blocks, place.at};
    });
    return 0;
  }
  const std::uint32_t first = first_map(kind, query.light);
  look_up_light(maker_, count, query.receivers, query.candidates, share, [&](int which) {
    const Place place = place_of(first + static_cast<std::size_t>(which));
    return std::pair{place.blocks, place.at};
  });
  return 0;
}

}  // namespace lightcuts
