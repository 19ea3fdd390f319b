// The kernels' text, included once by each shade_kernels_ISA.cpp, which defines LC_ISA and LC_ISA_NAME.
// No include guard on purpose.

#include "cpu/simd/lanes.h"
#include "cpu/simd/shade_kernels.h"
#include "kernels/light.h"
#include "kernels/offset_point.h"

namespace lightcuts::LC_ISA {
namespace {

using LanesVec3 = Vec3T<Lanes>;

LC_LANES_FN LanesVec3 broadcast(const Vec3& v) { return {Lanes(v.x), Lanes(v.y), Lanes(v.z)}; }

LC_LANES_FN LanesVec3 load(const PacketVec3& v, int first) {
  return {Lanes::load(v.x + first), Lanes::load(v.y + first), Lanes::load(v.z + first)};
}

LC_LANES_FN void store(LanesVec3 value, PacketVec3& v, int first) {
  value.x.store(v.x + first);
  value.y.store(v.y + first);
  value.z.store(v.z + first);
}

template <bool Flat>
LC_LANES_FN Receiver<Lanes, Flat> load_receiver(const ReceiverPacket& packet, int first) {
  Receiver<Lanes, Flat> receiver;
  receiver.position = load(packet.position, first);
  receiver.ns = load(packet.ns, first);
  if constexpr (!Flat) receiver.ng = load(packet.ng, first);
  return receiver;
}

LC_LANES_FN Spot<Lanes> load_spot(const PointRecord& point) {
  return {broadcast(point.position), broadcast(point.axis), Lanes(point.cos_outer), Lanes(point.inverse_range)};
}

// --- Sums over a block of lights, without visibility ---

template <bool Flat>
LC_LANES_FN bool sum_vpls_of(const ReceiverPacket& packet, const Vpl* vpls, std::size_t count, float min_distance_sq,
                             PacketSum& sum) {
  const Lanes clamp_sq(min_distance_sq);
  bool near = false;
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes, Flat> receiver = load_receiver<Flat>(packet, first);
    LanesVec3 light = broadcast(Vec3{});
    Lanes nearest_sq(std::numeric_limits<float>::max());
    for (const Vpl* vpl = vpls; vpl != vpls + count; ++vpl) {
      const VplFactor<Lanes> factor = vpl_factor(receiver, broadcast(vpl->position), broadcast(vpl->axis), clamp_sq);
      nearest_sq = min_of(factor.distance_sq, nearest_sq);
      light += broadcast(vpl->intensity) * factor.clamped;
    }
    store(light, sum.light, first);
    near |= bits(nearest_sq < clamp_sq) != 0;
  }
  return near;
}

bool sum_vpls(const ReceiverPacket& packet, const Vpl* vpls, std::size_t count, float min_distance_sq, PacketSum& sum) {
  return packet.flat ? sum_vpls_of<true>(packet, vpls, count, min_distance_sq, sum)
                     : sum_vpls_of<false>(packet, vpls, count, min_distance_sq, sum);
}

void sum_vpl_loss(const ReceiverPacket& packet, const Vpl* vpls, std::size_t count, float min_distance_sq,
                  PacketSum& sum) {
  const Lanes clamp_sq(min_distance_sq);
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes, false> receiver = load_receiver<false>(packet, first);
    Lanes lost(0.0f);
    for (const Vpl* vpl = vpls; vpl != vpls + count; ++vpl) {
      const VplFactor<Lanes> factor = vpl_factor(receiver, broadcast(vpl->position), broadcast(vpl->axis), clamp_sq);
      const Lanes taken = select(factor.distance_sq < clamp_sq, factor.unclamped - factor.clamped, Lanes(0.0f));
      lost = lost + taken * Lanes(luminance(vpl->intensity));
    }
    lost.store(sum.lost + first);
  }
}

void sum_points(const ReceiverPacket& packet, const PointRecord* points, std::size_t count, PacketSum& sum) {
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes, false> receiver = load_receiver<false>(packet, first);
    LanesVec3 light = broadcast(Vec3{});
    for (const PointRecord* point = points; point != points + count; ++point) {
      light += broadcast(point->intensity) * point_factor(receiver, load_spot(*point));
    }
    store(light, sum.light, first);
  }
}

void sum_directionals(const ReceiverPacket& packet, const DirectionalRecord* lights, std::size_t count,
                      PacketSum& sum) {
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes, false> receiver = load_receiver<false>(packet, first);
    LanesVec3 light = broadcast(Vec3{});
    for (const DirectionalRecord* from = lights; from != lights + count; ++from) {
      light += broadcast(from->irradiance) * directional_factor(receiver, broadcast(from->direction));
    }
    store(light, sum.light, first);
  }
}

// --- One light, with the rays that decide whether it is seen ---

LC_LANES_FN void store_rays(const ReceiverPacket& packet, int first, LanesVec3 direction, float t_max,
                            RayPacket16& rays) {
  const LanesVec3 origin = load(packet.position, first);
  origin.x.store(rays.ox + first);
  origin.y.store(rays.oy + first);
  origin.z.store(rays.oz + first);
  direction.x.store(rays.dx + first);
  direction.y.store(rays.dy + first);
  direction.z.store(rays.dz + first);
  Lanes(0.0f).store(rays.t_min + first);
  Lanes(t_max).store(rays.t_max + first);
}

LC_LANES_FN std::uint32_t store_factors(Lanes clamped, Lanes unclamped, int first, PacketFactors& factors) {
  clamped.store(factors.clamped + first);
  unclamped.store(factors.unclamped + first);
  return bits(clamped > Lanes(0.0f)) << first;
}

/// Rays from the receivers to one place; distances count in the ray's length, so the place is at t = 1.
LC_LANES_FN void store_rays_to(const ReceiverPacket& packet, int first, const Vec3& target, RayPacket16& rays) {
  store_rays(packet, first, broadcast(target) - load(packet.position, first), 1.0f, rays);
}

std::uint32_t vpl_shadow_rays(const ReceiverPacket& packet, const Vpl& vpl, float min_distance_sq,
                              PacketFactors& factors, RayPacket16& rays) {
  const Vec3 target = offset_point(vpl.position, vpl.axis);
  std::uint32_t lit = 0;
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const VplFactor<Lanes> factor = vpl_factor(load_receiver<false>(packet, first), broadcast(vpl.position),
                                               broadcast(vpl.axis), Lanes(min_distance_sq));
    lit |= store_factors(factor.clamped, factor.unclamped, first, factors);
    store_rays_to(packet, first, target, rays);
  }
  return lit;
}

std::uint32_t point_shadow_rays(const ReceiverPacket& packet, const PointRecord& point, PacketFactors& factors,
                                RayPacket16& rays) {
  std::uint32_t lit = 0;
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Lanes factor = point_factor(load_receiver<false>(packet, first), load_spot(point));
    lit |= store_factors(factor, factor, first, factors);
    store_rays_to(packet, first, point.position, rays);
  }
  return lit;
}

std::uint32_t directional_shadow_rays(const ReceiverPacket& packet, const DirectionalRecord& light,
                                      PacketFactors& factors, RayPacket16& rays) {
  std::uint32_t lit = 0;
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Lanes factor = directional_factor(load_receiver<false>(packet, first), broadcast(light.direction));
    lit |= store_factors(factor, factor, first, factors);
    store_rays(packet, first, -broadcast(light.direction), std::numeric_limits<float>::infinity(), rays);
  }
  return lit;
}

void accumulate(const PacketFactors& factors, Vec3 intensity, const float* share, PacketSum& sum) {
  const Lanes power(luminance(intensity));
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Lanes visible = Lanes::load(share + first);
    const Lanes clamped = visible * Lanes::load(factors.clamped + first);
    const Lanes unclamped = visible * Lanes::load(factors.unclamped + first);
    store(load(sum.light, first) + broadcast(intensity) * clamped, sum.light, first);
    (Lanes::load(sum.lost + first) + (unclamped - clamped) * power).store(sum.lost + first);
  }
}

}  // namespace

extern const ShadeKernels kernels;
const ShadeKernels kernels{
    LC_ISA_NAME,       Lanes::kCount,           sum_vpls,  sum_vpl_loss, sum_points, sum_directionals, vpl_shadow_rays,
    point_shadow_rays, directional_shadow_rays, accumulate};

}  // namespace lightcuts::LC_ISA
