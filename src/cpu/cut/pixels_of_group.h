#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"
#include "cpu/cut/receiver_groups.h"

namespace lightcuts {

/// What a pixel of a group has come to.
struct PixelState {
  double threshold = 0;
  double total = 0;                 ///< luminance of the reflected light, times pi
  Vec3T<double> light, fixed;       ///< of the cut; of its leaves
  double lost = 0, fixed_lost = 0;  ///< luminance that the clamp took
  float largest = 0;                ///< bound of a node, in the total's unit
  float weight = 0;                 ///< luminance of the albedo
  int rounds = 0;
};

/// What the nodes of a round are tested with.
struct Aim {
  Vec3 weights;           ///< as in GroupWalk
  std::uint32_t packets;  ///< those of the pixels that the round is for, as bits
};

/// Chosen nodes of one kind of light, and how much of each arrives; no shares: all of it.
struct LitNodes {
  LightKind kind;
  const CutLight* lights;
  const PacketShare* shares;
  std::size_t count;
};

/// The pixels of a group side by side: what they receive with, what they got, and which of them still wait.
class GroupPixels {
 public:
  GroupPixels(std::span<const SurfacePacket> tile, const PixelGroup& group);

  [[nodiscard]] int packet_count() const { return packet_count_; }
  [[nodiscard]] const ReceiverPacket& receivers(int packet) const { return receivers_[packet]; }
  [[nodiscard]] std::uint32_t pending(int packet) const { return pending_[packet]; }
  [[nodiscard]] PixelState& operator[](int i) { return pixels_[i]; }

  template <class Visit>
  void for_each_pending(Visit visit) {
    for (int p = 0; p < packet_count_; ++p) {
      for (std::uint32_t lanes = pending_[p]; lanes != 0; lanes &= lanes - 1)
        visit(p * kPacketSize + std::countr_zero(lanes));
    }
  }
  [[nodiscard]] bool any_pending() const {
    return std::any_of(pending_, pending_ + packet_count_, [](std::uint32_t lanes) { return lanes != 0; });
  }
  void leave(int i) { pending_[i / kPacketSize] &= ~(1u << (i % kPacketSize)); }

  /// Luminance of what pixel i reflects of `light`, times pi.
  [[nodiscard]] double reflected(int i, const Vec3T<double>& light) const;

  /// Aims at the pixels with the largest thresholds, and those within a factor of `level_ratio`; the others' turn comes
  /// later.
  Aim aim(float level_ratio);

  /// Adds nodes to light, lost and largest of the pixels of a packet; returns the pairs evaluated.
  std::uint64_t add(int packet, const LitNodes& nodes, const CutContext& context, const CutKernels& kernels);

  /// Sets a packet's light to that of the leaves alone; or to nothing; or counts what was added since among the leaves'.
  void start_from_leaves(int packet);
  void start_from_nothing(int packet);
  void keep_as_leaves(int packet);

 private:
  int packet_count_;
  ReceiverPacket receivers_[kTilePackets];
  PacketVec3 weights_[kTilePackets];
  std::uint32_t pending_[kTilePackets] = {};
  PixelState pixels_[kTilePixels];
};

}  // namespace lightcuts
