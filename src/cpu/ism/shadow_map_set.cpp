#include "cpu/ism/shadow_map_set.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "cpu/ism/fill_holes.h"
#include "cpu/progress.h"
#include "kernels/draw_map.h"

namespace lightcuts {
namespace {

constexpr std::size_t kPadding = 16;  // entries past the last that kernels may touch

std::vector<std::uint32_t> every(std::size_t count, std::size_t offset, std::size_t stride) {
  std::vector<std::uint32_t> ids;
  ids.reserve(count / stride + 1);
  for (std::size_t i = offset; i < count; i += stride) ids.push_back(static_cast<std::uint32_t>(i));
  return ids;
}

struct FreeAligned {
  void operator()(float* floats) const { ::operator delete[](floats, std::align_val_t{64}); }
};

}  // namespace

/// A map to make.
struct ShadowMapSet::Order {
  LightKind kind;
  std::uint32_t light;
  int which;
  std::size_t slot;
};

struct ShadowMapSet::Scratch {
  std::unique_ptr<float[], FreeAligned> nearness;
  FillScratch<std::uint16_t> fill16;
  FillScratch<std::uint32_t> fill32;
  std::vector<float> chosen;  ///< points that the noise chose
  std::vector<std::uint32_t> shapes;
};

LightIds every_light(const LightSet& lights, std::size_t offset, std::size_t stride) {
  return {every(lights.vpls.size(), offset, stride), every(lights.points.size(), offset, stride),
          every(lights.directionals.size(), offset, stride)};
}

ShadowMapSet::ShadowMapSet(const IsmKernels& kernels, const SurfacePoints& points, const LightSet& lights,
                           const ShadowMapOptions& options)
    : kernels_(kernels), points_(points), lights_(lights), options_(options) {
  clear();
}

ShadowMapSet::~ShadowMapSet() = default;

void ShadowMapSet::clear() {
  slots_[0].assign(lights_.vpls.size(), kNone);
  slots_[1].assign(lights_.points.size(), kNone);
  slots_[2].assign(lights_.directionals.size(), kNone);
  map_count_ = 0;
}

std::size_t ShadowMapSet::texels() const {
  return static_cast<std::size_t>(options_.size) * static_cast<std::size_t>(options_.size);
}

std::uint16_t* ShadowMapSet::codes_at(std::size_t slot) const {
  return codes_.get() + slot * texels() * static_cast<std::size_t>(options_.depth_bits / 16);
}

void ShadowMapSet::grow(std::size_t maps) {
  if (maps <= capacity_ && codes_ != nullptr) return;
  const std::size_t entries = texels() * static_cast<std::size_t>(options_.depth_bits / 16);
  auto larger = std::make_unique_for_overwrite<std::uint16_t[]>(maps * entries + kPadding);
  std::copy_n(codes_.get(), capacity_ * entries, larger.get());
  codes_ = std::move(larger);
  capacity_ = maps;
}

ShadowMapSet::Scratch& ShadowMapSet::scratch() {
  std::unique_ptr<Scratch>& mine = scratch_.local();
  if (mine == nullptr) {
    mine = std::make_unique<Scratch>();
    mine->nearness.reset(new (std::align_val_t{64}) float[nearness_floats(options_.size)]);
  }
  return *mine;
}

void ShadowMapSet::reserve_all() {
  clear();
  const LightIds all = every_light(lights_);
  std::vector<Order> orders;
  place(LightKind::vpl, all.vpls, orders);
  place(LightKind::point, all.points, orders);
  place(LightKind::directional, all.directionals, orders);
  grow(map_count_);
  ready_ = std::make_unique<std::atomic<State>[]>(map_count_);
}

void ShadowMapSet::make_missing(LightKind kind, std::uint32_t light) {
  const std::size_t slot = slots(kind)[light];
  std::atomic<State>& state = ready_[slot];
  if (state.load(std::memory_order_acquire) == ready) return;
  State before = missing;
  if (!state.compare_exchange_strong(before, in_work, std::memory_order_acquire)) {
    state.wait(in_work, std::memory_order_acquire);
    return;
  }
  const int count = maps_for(kind, light);
  for (int which = 0; which < count; ++which) {
    make({kind, light, which, slot + static_cast<std::size_t>(which)}, scratch());
  }
  made_.fetch_add(static_cast<std::size_t>(count));
  state.store(ready, std::memory_order_release);
  state.notify_all();
}

std::uint64_t ShadowMapSet::bytes_per_map(const ShadowMapOptions& options) {
  const auto side = static_cast<std::uint64_t>(options.size);
  return side * side * static_cast<std::uint64_t>(options.depth_bits) / 8;
}

std::uint64_t ShadowMapSet::maps_of(const LightSet& lights) {
  std::uint64_t count = lights.vpls.size() + lights.directionals.size();
  for (const PointRecord& light : lights.points) count += static_cast<std::uint64_t>(point_map_count(light.cos_outer));
  return count;
}

int ShadowMapSet::maps_for(LightKind kind, std::uint32_t light) const {
  return kind == LightKind::point ? point_map_count(lights_.points[light].cos_outer) : 1;
}

MapView ShadowMapSet::view_of(LightKind kind, std::uint32_t light, int which) const {
  if (kind == LightKind::vpl) {
    return vpl_map_view(lights_.vpls[light].position, lights_.vpls[light].axis, points_.bounds());
  }
  if (kind == LightKind::directional) {
    return orthographic_view(lights_.directionals[light].direction, points_.bounds());
  }
  const PointRecord& point = lights_.points[light];
  return point_map_view(point.position, point.axis, points_.bounds(), options_.size, which);
}

void ShadowMapSet::place(LightKind kind, const std::vector<std::uint32_t>& ids, std::vector<Order>& orders) {
  for (const std::uint32_t light : ids) {
    std::uint32_t& slot = slots_[static_cast<std::size_t>(kind)][light];
    if (slot != kNone) continue;
    slot = static_cast<std::uint32_t>(map_count_);
    for (int which = 0; which < maps_for(kind, light); ++which) orders.push_back({kind, light, which, map_count_++});
  }
}

bool ShadowMapSet::add(const LightIds& ids, Progress* progress) {
  std::vector<Order> orders;
  place(LightKind::vpl, ids.vpls, orders);
  place(LightKind::point, ids.points, orders);
  place(LightKind::directional, ids.directionals, orders);
  grow(map_count_);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, orders.size(), 4),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i != range.end(); ++i) {
                        if (progress != nullptr && progress->stopped()) return;
                        make(orders[i], scratch());
                        if (progress != nullptr) progress->advance(1);
                      }
                    });
  if (progress == nullptr || !progress->stopped()) return true;
  clear();
  return false;
}

void ShadowMapSet::make(const Order& order, Scratch& scratch) {
  const MapView view = view_of(order.kind, order.light, order.which);
  std::fill_n(scratch.nearness.get(), nearness_floats(options_.size), 0.0f);
  draw(order, view, scratch);
  if (options_.depth_bits == 16) {
    std::uint16_t* codes = codes_at(order.slot);
    kernels_.encode16(scratch.nearness.get(), view, options_.size, codes);
    fill_holes(codes, options_.size, options_.levels, options_.fill, scratch.fill16);
  } else {
    auto* codes = reinterpret_cast<std::uint32_t*>(codes_at(order.slot));
    kernels_.encode32(scratch.nearness.get(), view, options_.size, codes);
    fill_holes(codes, options_.size, options_.levels, options_.fill, scratch.fill32);
  }
}

/// Draws the map's points: a block of the order from a random start, or the study's subset by a noise of point and light.
void ShadowMapSet::draw(const Order& order, const MapView& view, Scratch& scratch) const {
  const std::size_t all = points_.size(), wanted = std::min<std::size_t>(points_.options().per_map, all);
  if (all == 0) return;
  const PointArrays& arrays = points_.arrays();
  const std::uint32_t stream = map_stream(order.light, static_cast<std::uint32_t>(order.kind), map_seed(options_.seed));
  if (options_.choice == PointChoice::block) {
    const std::size_t start = block_start(stream, static_cast<std::uint32_t>(all));
    const std::size_t until_end = std::min(wanted, all - start);
    kernels_.draw(arrays, start, until_end, view, options_.size, scratch.nearness.get());
    kernels_.draw(arrays, 0, wanted - until_end, view, options_.size, scratch.nearness.get());
    return;
  }

  const double share = static_cast<double>(wanted) / static_cast<double>(all);
  std::size_t count = 0;
  const std::size_t stride = all + kPadding;
  scratch.chosen.resize(6 * stride);
  scratch.shapes.resize(stride);
  const float* from[6] = {arrays.x, arrays.y, arrays.z, arrays.normal_x, arrays.normal_y, arrays.normal_z};
  for (std::size_t i = 0; i < all; ++i) {
    if (!noise_chooses(static_cast<std::uint32_t>(i), stream, share)) continue;
    for (std::size_t c = 0; c < 6; ++c) scratch.chosen[c * stride + count] = from[c][i];
    scratch.shapes[count++] = arrays.shape[i];
  }
  const float* c = scratch.chosen.data();
  const PointArrays chosen{c,
                           c + stride,
                           c + 2 * stride,
                           c + 3 * stride,
                           c + 4 * stride,
                           c + 5 * stride,
                           scratch.shapes.data(),
                           arrays.shapes};
  kernels_.draw(chosen, 0, count, view, options_.size, scratch.nearness.get());
}

DepthCodes ShadowMapSet::map_at(std::size_t slot) const { return {codes_at(slot), options_.size, options_.depth_bits}; }

std::vector<std::uint32_t> ShadowMapSet::codes_of(LightKind kind, std::uint32_t light, int which) const {
  const std::uint16_t* from = codes_at(slots(kind)[light] + static_cast<std::size_t>(which));
  std::vector<std::uint32_t> codes(texels());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    codes[i] = options_.depth_bits == 16 ? from[i] : reinterpret_cast<const std::uint32_t*>(from)[i];
  }
  return codes;
}

void ShadowMapSet::shares(LightKind kind, std::uint32_t light, const ReceiverPacket& receivers, float* share) const {
  const std::uint32_t slot = slots(kind)[light];
  if (slot == kNone) {
    std::fill_n(share, kPacketSize, 1.0f);
    return;
  }
  const MapView view = view_of(kind, light);
  kernels_.look_up(receivers, view, map_at(slot), share);
  if (maps_for(kind, light) == 1) return;

  std::uint32_t behind = 0;
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const Vec3 at{receivers.position.x[lane], receivers.position.y[lane], receivers.position.z[lane]};
    behind |= (dot(at - view.origin, view.frame.z) < 0 ? 1u : 0u) << lane;
  }
  if (behind == 0) return;
  alignas(64) float other[kPacketSize];
  kernels_.look_up(receivers, opposite(view), map_at(slot + std::size_t{1}), other);
  for (int lane = 0; lane < kPacketSize; ++lane) {
    if ((behind >> lane & 1u) != 0) share[lane] = other[lane];
  }
}

namespace {

void clear_others(std::uint32_t candidates, float* share) {
  for (int lane = 0; lane < kPacketSize; ++lane) {
    if ((candidates >> lane & 1u) == 0) share[lane] = 0;
  }
}

}  // namespace

std::uint32_t ShadowMapVisibility::shares(const VisibilityQuery& query, float* share) const {
  maps_.shares(query.kind, query.light, query.receivers, share);
  clear_others(query.candidates, share);
  return 0;
}

std::uint32_t ShadowMapsOnDemand::shares(const VisibilityQuery& query, float* share) const {
  if (query.candidates == 0) {
    std::fill_n(share, kPacketSize, 0.0f);
    return 0;
  }
  maps_.make_missing(query.kind, query.light);
  maps_.shares(query.kind, query.light, query.receivers, share);
  clear_others(query.candidates, share);
  return 0;
}

}  // namespace lightcuts
