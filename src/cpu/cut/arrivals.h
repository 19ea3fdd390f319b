#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"
#include "cpu/cut/pixels_of_group.h"
#include "cpu/cut/receiver_groups.h"
#include "cpu/simd/shade_kernels.h"
#include "cpu/tile.h"
#include "kernels/group_lookup.h"

namespace lightcuts {

/// Chosen nodes of one kind of light.
struct CutEntries {
  std::vector<CutLight> lights;
  /// By packet: how much of each arrives; empty without visibility, and for packets that had left when a light came.
  std::array<std::vector<PacketShare>, kTilePackets> shares;
  std::size_t asked = 0;  ///< lights, from the first on, whose shares are known

  void clear() {
    lights.clear();
    for (std::vector<PacketShare>& of_packet : shares) of_packet.clear();
    asked = 0;
  }
};

/// Finds how much of representatives' light arrives at the pixels of a group. Everything referred to must outlive it.
class Arrivals {
 public:
  Arrivals(const CutContext& context, const ShadeKernels& shade, std::span<const SurfacePacket> tile,
           const PixelGroup& group, const GroupPixels& pixels, TileLight& out);

  /// Adds how much of a light arrives to the shares of `entries`: what `old` has at `kept`, or else by asking, for a flat
  /// group perhaps later.
  void ask(LightKind kind, std::uint32_t light, std::uint32_t kept, const CutEntries& old, CutEntries& entries);

  /// Asks for the lights that wait for it, once for all pixels where that is possible. Their entries must not have moved.
  void ask_waiting();

 private:
  /// A light whose share is not known yet, and where it belongs.
  struct Waiting {
    CutEntries* entries;
    std::size_t at;
    std::uint32_t light;
  };

  void set_shares(const Waiting& waiting, float share) const;
  void ask_packet(LightKind kind, std::uint32_t light, int packet, PacketShare& share);
  std::uint32_t shadow_rays(LightKind kind, std::uint32_t light, const ReceiverPacket& receivers,
                            PacketFactors& factors, RayPacket16& rays) const;

  const CutContext& context_;
  const ShadeKernels& shade_;
  const GroupPixels& pixels_;
  TileLight& out_;
  FlatReceivers flat_{};  ///< reach infinite: no look serves all pixels
  bool flat_normals_ = true;
  Waiting waiting_[kPacketSize];
  int waiting_count_ = 0;
};

}  // namespace lightcuts
