#include "cpu/ism/shadow_map_set.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "cpu/progress.h"

namespace lightcuts {
namespace {

std::vector<std::uint32_t> every(std::size_t count, std::size_t offset, std::size_t stride) {
  std::vector<std::uint32_t> ids;
  ids.reserve(count / stride + 1);
  for (std::size_t i = offset; i < count; i += stride) ids.push_back(static_cast<std::uint32_t>(i));
  return ids;
}

}  // namespace

/// A map to make.
struct ShadowMapSet::Order {
  LightKind kind;
  std::uint32_t light;
  int which;
  std::size_t slot;
};

LightIds every_light(const LightSet& lights, std::size_t offset, std::size_t stride) {
  return {every(lights.vpls.size(), offset, stride), every(lights.points.size(), offset, stride),
          every(lights.directionals.size(), offset, stride)};
}

ShadowMapSet::ShadowMapSet(const IsmKernels& kernels, const SurfacePoints& points, const LightSet& lights,
                           const ShadowMapOptions& options)
    : maker_(kernels, points, lights, options) {
  clear();
}

void ShadowMapSet::clear() {
  const LightSet& lights = maker_.lights();
  slots_[0].assign(lights.vpls.size(), kNone);
  slots_[1].assign(lights.points.size(), kNone);
  slots_[2].assign(lights.directionals.size(), kNone);
  map_count_ = 0;
}

void ShadowMapSet::grow(std::size_t maps) {
  if (maps <= capacity_) return;
  MapBlocks larger(maker_.options(), maps);
  if (capacity_ > 0) std::memcpy(larger.record(0), blocks_.record(0), capacity_ * MapBlocks::stride(maker_.options()));
  blocks_ = std::move(larger);
  capacity_ = maps;
}

void ShadowMapSet::place(LightKind kind, const std::vector<std::uint32_t>& ids, std::vector<Order>& orders) {
  for (const std::uint32_t light : ids) {
    std::uint32_t& slot = slots_[static_cast<std::size_t>(kind)][light];
    if (slot != kNone) continue;
    slot = static_cast<std::uint32_t>(map_count_);
    const int count = maker_.maps_for(kind, light);
    for (int which = 0; which < count; ++which) orders.push_back({kind, light, which, map_count_++});
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
                        const Order& order = orders[i];
                        blocks_.make(maker_, order.kind, order.light, order.which, order.slot);
                        if (progress != nullptr) progress->advance(1);
                      }
                    });
  if (progress == nullptr || !progress->stopped()) return true;
  clear();
  return false;
}

std::vector<std::uint32_t> ShadowMapSet::codes_of(LightKind kind, std::uint32_t light, int which) const {
  const std::uint16_t* from = blocks_.codes(slots(kind)[light] + static_cast<std::size_t>(which));
  const auto side = static_cast<std::size_t>(maker_.options().size);
  std::vector<std::uint32_t> codes(side * side);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    codes[i] = maker_.options().depth_bits == 16 ? from[i] : reinterpret_cast<const std::uint32_t*>(from)[i];
  }
  return codes;
}

void ShadowMapSet::shares(LightKind kind, std::uint32_t light, const ReceiverPacket& receivers,
                          std::uint32_t candidates, float* share) const {
  const std::uint32_t slot = slots(kind)[light];
  if (slot == kNone) {
    for (int lane = 0; lane < kPacketSize; ++lane) share[lane] = static_cast<float>(candidates >> lane & 1u);
    return;
  }
  look_up_light(maker_, maker_.maps_for(kind, light), receivers, candidates, share, [&](int which) {
    return std::pair{&blocks_, slot + static_cast<std::size_t>(which)};
  });
}

std::uint32_t ShadowMapVisibility::shares(const VisibilityQuery& query, float* share) const {
  maps_.shares(query.kind, query.light, query.receivers, query.candidates, share);
  return 0;
}

}  // namespace lightcuts
