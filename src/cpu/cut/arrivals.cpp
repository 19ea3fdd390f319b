#include "cpu/cut/arrivals.h"

#include <algorithm>

#include "cpu/cut/flat_group.h"

namespace lightcuts {

Arrivals::Arrivals(const CutContext& context, const ShadeKernels& shade, std::span<const SurfacePacket> tile,
                   const PixelGroup& group, const GroupPixels& pixels, TileLight& out)
    : context_(context), shade_(shade), pixels_(pixels), out_(out) {
  flat_.reach = kInfinity;
  if (context_.visibility != nullptr && context_.visibility->knows_groups()) {
    flat_ = flat_receivers(tile, group);
    for (int p = 0; p < pixels_.packet_count(); ++p) flat_normals_ = flat_normals_ && pixels_.receivers(p).flat;
  }
}

void Arrivals::ask(LightKind kind, std::uint32_t light, std::uint32_t kept, const CutEntries& old,
                   CutEntries& entries) {
  const bool for_all = kept == kNone && kind == LightKind::vpl && flat_.reach < kInfinity;
  for (int p = 0; p < pixels_.packet_count(); ++p) {
    if (pixels_.pending(p) == 0) continue;
    const auto at = static_cast<std::size_t>(p);
    if (kept != kNone) {
      entries.shares[at].push_back(old.shares[at][kept]);
    } else if (for_all) {
      entries.shares[at].emplace_back();
    } else {
      ask_packet(kind, light, p, entries.shares[at].emplace_back());
    }
  }
  if (for_all) {
    if (lights_none(flat_, context_.lights.vpls[light], flat_normals_)) {
      set_shares({&entries, entries.asked, light}, 0);
    } else {
      waiting_[waiting_count_++] = {&entries, entries.asked, light};
      if (waiting_count_ == kPacketSize) ask_waiting();
    }
  }
  ++entries.asked;
}

void Arrivals::ask_waiting() {
  if (waiting_count_ == 0) return;
  alignas(64) float shares[kPacketSize];
  std::uint32_t vpls[kPacketSize];
  for (int i = 0; i < waiting_count_; ++i) vpls[i] = waiting_[i].light;
  context_.visibility->group_shares(flat_, {vpls, static_cast<std::size_t>(waiting_count_)}, shares);
  for (int i = 0; i < waiting_count_; ++i) {
    if (shares[i] != kEachItsOwn) {
      set_shares(waiting_[i], shares[i]);
      continue;
    }
    for (int p = 0; p < pixels_.packet_count(); ++p) {
      if (pixels_.pending(p) == 0) continue;
      ask_packet(LightKind::vpl, waiting_[i].light, p,
                 waiting_[i].entries->shares[static_cast<std::size_t>(p)][waiting_[i].at]);
    }
  }
  waiting_count_ = 0;
}

void Arrivals::set_shares(const Waiting& waiting, float share) const {
  for (int p = 0; p < pixels_.packet_count(); ++p) {
    if (pixels_.pending(p) == 0) continue;
    std::fill_n(waiting.entries->shares[static_cast<std::size_t>(p)][waiting.at].of, kPacketSize, share);
  }
}

void Arrivals::ask_packet(LightKind kind, std::uint32_t light, int packet, PacketShare& share) {
  PacketFactors factors;
  RayPacket16 rays;
  const ReceiverPacket& receivers = pixels_.receivers(packet);
  const std::uint32_t candidates = shadow_rays(kind, light, receivers, factors, rays) & pixels_.pending(packet);
  if (candidates != 0) {
    out_.rays += context_.visibility->shares({kind, light, receivers, rays, candidates}, share.of);
  } else {
    std::fill_n(share.of, kPacketSize, 0.0f);
  }
}

std::uint32_t Arrivals::shadow_rays(LightKind kind, std::uint32_t light, const ReceiverPacket& receivers,
                                    PacketFactors& factors, RayPacket16& rays) const {
  const LightSet& lights = context_.lights;
  switch (kind) {
    case LightKind::vpl:
      return shade_.vpl_shadow_rays(receivers, lights.vpls[light], context_.min_distance_sq, factors, rays);
    case LightKind::point:
      return shade_.point_shadow_rays(receivers, lights.points[light], factors, rays);
    case LightKind::directional:
      return shade_.directional_shadow_rays(receivers, lights.directionals[light], factors, rays);
  }
  return 0;
}

}  // namespace lightcuts
