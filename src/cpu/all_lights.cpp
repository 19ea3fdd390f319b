#include "cpu/all_lights.h"

#include <algorithm>
#include <bit>

#include "cpu/progress.h"

namespace lightcuts {
namespace {

/// Lights in a block: they stay in the first-level cache while the packets of a tile pass over them, and their sum in
/// single precision loses nothing that matters before it goes into the total in double precision.
constexpr std::size_t kBlock = 256;

// What differs between the kinds of light.

struct VplKind {
  static constexpr LightKind kind = LightKind::vpl;
  const ShadeKernels& kernels;
  std::span<const Vpl> lights;
  float min_distance_sq;

  void sum(const ReceiverPacket& receivers, std::size_t first, std::size_t count, PacketSum& sum) const {
    std::fill(std::begin(sum.lost), std::end(sum.lost), 0.0f);
    if (kernels.sum_vpls(receivers, &lights[first], count, min_distance_sq, sum)) {
      kernels.sum_vpl_loss(receivers, &lights[first], count, min_distance_sq, sum);
    }
  }
  std::uint32_t rays(const ReceiverPacket& receivers, std::size_t light, PacketFactors& factors,
                     RayPacket16& rays) const {
    return kernels.vpl_shadow_rays(receivers, lights[light], min_distance_sq, factors, rays);
  }
  [[nodiscard]] Vec3 intensity(std::size_t light) const { return lights[light].intensity; }
};

struct PointKind {
  static constexpr LightKind kind = LightKind::point;
  const ShadeKernels& kernels;
  const std::vector<PointRecord>& lights;

  void sum(const ReceiverPacket& receivers, std::size_t first, std::size_t count, PacketSum& sum) const {
    kernels.sum_points(receivers, &lights[first], count, sum);
  }
  std::uint32_t rays(const ReceiverPacket& receivers, std::size_t light, PacketFactors& factors,
                     RayPacket16& rays) const {
    return kernels.point_shadow_rays(receivers, lights[light], factors, rays);
  }
  [[nodiscard]] Vec3 intensity(std::size_t light) const { return lights[light].intensity; }
};

struct DirectionalKind {
  static constexpr LightKind kind = LightKind::directional;
  const ShadeKernels& kernels;
  const std::vector<DirectionalRecord>& lights;

  void sum(const ReceiverPacket& receivers, std::size_t first, std::size_t count, PacketSum& sum) const {
    kernels.sum_directionals(receivers, &lights[first], count, sum);
  }
  std::uint32_t rays(const ReceiverPacket& receivers, std::size_t light, PacketFactors& factors,
                     RayPacket16& rays) const {
    return kernels.directional_shadow_rays(receivers, lights[light], factors, rays);
  }
  [[nodiscard]] Vec3 intensity(std::size_t light) const { return lights[light].irradiance; }
};

/// Sum over a block of lights with visibility; returns the number of rays.
template <class Kind>
std::uint64_t sum_visible(const Kind& kind, const ShadeKernels& kernels, const PacketVisibility& visibility,
                          const ReceiverPacket& receivers, LightStride part, std::size_t first, std::size_t count,
                          PacketSum& sum) {
  PacketFactors factors;
  RayPacket16 rays;
  alignas(64) float share[kPacketSize];
  std::uint64_t traced = 0;
  for (std::size_t i = first; i < first + count; ++i) {
    const std::size_t light = part.offset + i * part.stride;
    const std::uint32_t candidates = kind.rays(receivers, light, factors, rays) & receivers.active;
    if (candidates == 0) continue;
    traced += visibility.shares({Kind::kind, static_cast<std::uint32_t>(light), receivers, rays, candidates}, share);
    kernels.accumulate(factors, kind.intensity(light), share, sum);
  }
  return traced;
}

void add(const PacketSum& sum, int packet, TileLight& out) {
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const int pixel = packet * kPacketSize + lane;
    out.light[pixel] += Vec3T<double>{sum.light.x[lane], sum.light.y[lane], sum.light.z[lane]};
    out.lost[pixel] += sum.lost[lane];
  }
}

}  // namespace

template <class Kind>
bool AllLights::light_by(const Kind& kind, const Tile& tile, Progress& progress, TileLight& out) const {
  const std::size_t total = part_.count_of(kind.lights.size());
  const double all = static_cast<double>(lights_.vpls.size() + lights_.points.size() + lights_.directionals.size());
  for (std::size_t first = 0; first < total; first += kBlock) {
    const std::size_t count = std::min(kBlock, total - first);
    for (int p = 0; p < kTilePackets; ++p) {
      const ReceiverPacket& receivers = tile.packets[static_cast<std::size_t>(p)].receivers;
      if (receivers.active == 0) continue;
      PacketSum sum{};
      if (visibility_ == nullptr) {
        kind.sum(receivers, first, count, sum);
      } else {
        out.rays += sum_visible(kind, kernels_, *visibility_, receivers, part_, first, count, sum);
      }
      add(sum, p, out);
      out.pairs += static_cast<std::uint64_t>(std::popcount(receivers.active)) * count;
    }
    if (!progress.advance(static_cast<double>(count) / all)) return false;
  }
  return true;
}

bool AllLights::light(const Tile& tile, Progress& progress, TileLight& out) const {
  return light_by(VplKind{kernels_, lights_.vpls, min_distance_sq_}, tile, progress, out) &&
         light_by(PointKind{kernels_, lights_.points}, tile, progress, out) &&
         light_by(DirectionalKind{kernels_, lights_.directionals}, tile, progress, out);
}

}  // namespace lightcuts
