#pragma once

#include <random>

#include "cpu/simd/packet.h"
#include "lightcuts/lights.h"

namespace lightcuts {

/// Random points, directions and receivers of tests.
class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}

  float between(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(engine_); }
  Vec3 in_box(float half) { return {between(-half, half), between(-half, half), between(-half, half)}; }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = in_box(1);
      if (length_sq(v) > 0.01f && length_sq(v) <= 1) return normalize(v);
    }
  }
  Vec3 color() { return {between(0, 1), between(0, 1), between(0, 1)}; }

 private:
  std::mt19937 engine_;
};

inline void set_lane(PacketVec3& packet, int lane, Vec3 v) {
  packet.x[lane] = v.x;
  packet.y[lane] = v.y;
  packet.z[lane] = v.z;
}
inline Vec3 get_lane(const PacketVec3& packet, int lane) { return {packet.x[lane], packet.y[lane], packet.z[lane]}; }

/// Sixteen receivers within `half` of the origin.
inline ReceiverPacket random_receivers(Dice& dice, bool flat, float half = 1) {
  ReceiverPacket packet{};
  packet.flat = flat;
  packet.active = 0xffff;
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const Vec3 ng = dice.direction();
    const Vec3 bent = normalize(ng + dice.direction() * 0.5f);
    set_lane(packet.position, lane, dice.in_box(half));
    set_lane(packet.ng, lane, ng);
    set_lane(packet.ns, lane, flat ? ng : bent);
  }
  return packet;
}

inline Vpl random_vpl(Dice& dice, float half = 1) {
  const Vec3 position = dice.in_box(half);
  return {position, dice.direction(), dice.color()};
}

}  // namespace lightcuts
