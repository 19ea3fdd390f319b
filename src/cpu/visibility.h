#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "cpu/ray_packet.h"
#include "cpu/simd/packet.h"
#include "kernels/group_lookup.h"

namespace lightcuts {

class RayTracer;

enum class LightKind : std::uint8_t { vpl, point, directional };

/// One light and the receivers of a packet that it may reach.
struct VisibilityQuery {
  LightKind kind;
  std::uint32_t light;  ///< index within its kind
  const ReceiverPacket& receivers;
  const RayPacket16& rays;   ///< from each receiver to the light
  std::uint32_t candidates;  ///< bit i: receiver i asks
};

/// How much of a light arrives. No such object at all means Visibility::none.
class PacketVisibility {
 public:
  virtual ~PacketVisibility() = default;

  /// Writes to `share` (16 floats, aligned to 64 bytes) how much of the light arrives at each receiver, [0, 1]; 0 in
  /// lanes that do not ask. Returns the number of rays traced. Called by many threads at once.
  virtual std::uint32_t shares(const VisibilityQuery& query, float* share) const = 0;

  /// Whether light may come through where it should not: then what is hidden for certain matters more.
  [[nodiscard]] virtual bool leaks() const { return false; }

  /// Whether group_shares is worth a try.
  [[nodiscard]] virtual bool knows_groups() const { return false; }

  /// Writes to `share` (aligned to 64 bytes) how much of each of up to 16 VPLs arrives at every receiver of a flat group that it
  /// may light, or kEachItsOwn: each packet has to ask. Called by many threads at once.
  virtual void group_shares(const FlatReceivers&, std::span<const std::uint32_t> vpls, float* share) const {
    std::fill_n(share, vpls.size(), kEachItsOwn);
  }
};

/// Exact shadow rays.
class RayVisibility final : public PacketVisibility {
 public:
  /// The tracer must outlive this.
  explicit RayVisibility(const RayTracer& tracer) : tracer_(tracer) {}
  std::uint32_t shares(const VisibilityQuery& query, float* share) const override;

 private:
  const RayTracer& tracer_;
};

}  // namespace lightcuts
