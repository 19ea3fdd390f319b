#include "cpu/cut/receiver_groups.h"

#include <algorithm>
#include <array>
#include <bit>

namespace lightcuts {
namespace {

struct Receivers {
  std::array<Vec3, kTilePixels> position, normal;
};

Vec3 lane_of(const PacketVec3& v, int lane) { return {v.x[lane], v.y[lane], v.z[lane]}; }

Vec3 position_of(std::span<const SurfacePacket> packets, std::uint8_t pixel) {
  return lane_of(packets[pixel / kPacketSize].receivers.position, pixel % kPacketSize);
}
Vec3 normal_of(std::span<const SurfacePacket> packets, std::uint8_t pixel) {
  return lane_of(packets[pixel / kPacketSize].receivers.ns, pixel % kPacketSize);
}

/// Where the pixels differ most, relative to what is allowed.
struct Spread {
  float size = 0;  ///< at most 1: within the limits
  bool of_normals = false;
  int axis = 0;
  float middle = 0;
};

class Grouping {
 public:
  Grouping(std::span<const SurfacePacket> packets, const GroupLimits& limits) : packets_(packets), limits_(limits) {}

  std::vector<PixelGroup> run() {
    PixelGroup all;
    for (std::size_t p = 0; p < packets_.size(); ++p) {
      for (std::uint32_t lanes = packets_[p].receivers.active; lanes != 0; lanes &= lanes - 1) {
        all.pixels[all.count++] =
            static_cast<std::uint8_t>(p * kPacketSize + static_cast<unsigned>(std::countr_zero(lanes)));
      }
    }
    if (all.count > 0) split(all.pixels, all.count);
    return std::move(groups_);
  }

 private:
  [[nodiscard]] Spread spread_of(const std::uint8_t* pixels, int count) const {
    Box positions, normals;
    for (int i = 0; i < count; ++i) {
      positions = extend(positions, position_of(packets_, pixels[i]));
      normals = extend(normals, normal_of(packets_, pixels[i]));
    }
    // A box of normals of this diagonal lies within the cone of the limit about its middle, or nearly so.
    const float normal_limit = 2 * std::sqrt(max_of(1 - limits_.cosine * limits_.cosine, 1e-12f));
    Spread spread;
    float widest = 0;
    for (int k = 0; k < 6; ++k) {
      const Box& box = k < 3 ? positions : normals;
      const float limit = k < 3 ? limits_.extent : normal_limit;
      const float width = component(box.hi, k % 3) - component(box.lo, k % 3);
      if (!(width > widest * limit)) continue;
      widest = width / limit;
      spread.of_normals = k >= 3;
      spread.axis = k % 3;
      spread.middle = 0.5f * (component(box.hi, k % 3) + component(box.lo, k % 3));
    }
    spread.size = max_of(diagonal(positions) / limits_.extent, diagonal(normals) / normal_limit);
    return spread;
  }

  void split(std::uint8_t* pixels, int count) {
    const Spread spread = spread_of(pixels, count);
    if (count == 1 || (count <= limits_.pixels && spread.size <= 1)) {
      PixelGroup& group = groups_.emplace_back();
      std::copy_n(pixels, count, group.pixels);
      group.count = count;
      return;
    }
    const auto lower = [&](std::uint8_t pixel) {
      const Vec3 v = spread.of_normals ? normal_of(packets_, pixel) : position_of(packets_, pixel);
      return component(v, spread.axis) < spread.middle;
    };
    int below = static_cast<int>(std::stable_partition(pixels, pixels + count, lower) - pixels);
    if (below == 0 || below == count) below = count / 2;
    split(pixels, below);
    split(pixels + below, count - below);
  }

  std::span<const SurfacePacket> packets_;
  const GroupLimits& limits_;
  std::vector<PixelGroup> groups_;
};

}  // namespace

std::vector<PixelGroup> group_pixels(std::span<const SurfacePacket> packets, const GroupLimits& limits) {
  return Grouping(packets, limits).run();
}

ReceiverGroup<float> bound_receivers(std::span<const SurfacePacket> packets, const PixelGroup& group) {
  Box box;
  Vec3 sum;
  bool all_same = true;
  const Vec3 first = normal_of(packets, group.pixels[0]);
  for (int i = 0; i < group.count; ++i) {
    const Vec3 normal = normal_of(packets, group.pixels[i]);
    box = extend(box, position_of(packets, group.pixels[i]));
    sum += normal;
    all_same = all_same && normal == first;
  }
  const Vec3 axis = group_axis(sum, first, all_same);
  float cosine = 1, gain_lo = kInfinity, gain_hi = kInfinity;
  for (int i = 0; i < group.count; ++i) {
    const Vec3 p = position_of(packets, group.pixels[i]);
    cosine = min_of(cosine, group_cosine(axis, normal_of(packets, group.pixels[i])));
    gain_lo = min_of(gain_lo, gap_to_end(-axis, box, p));
    gain_hi = min_of(gain_hi, gap_to_end(axis, box, p));
  }
  return receiver_group<float>(box, axis, cosine, gain_lo, gain_hi);
}

}  // namespace lightcuts
