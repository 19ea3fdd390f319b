#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

#include "cpu/ism/map_maker.h"

namespace lightcuts {

/// Room for maps, each with its record before its codes: what a lookup needs lies together, and two maps never lie a
/// power of two apart, so that they do not compete for the same places of a cache.
class MapBlocks {
 public:
  MapBlocks() = default;
  MapBlocks(const ShadowMapOptions& options, std::size_t maps)
      : stride_(stride(options)), bytes_(new (std::align_val_t{64}) std::byte[maps * stride_ + kPadding]) {}

  [[nodiscard]] MapRecord* record(std::size_t map) const {
    return std::launder(reinterpret_cast<MapRecord*>(bytes_.get() + map * stride_));
  }
  [[nodiscard]] std::uint16_t* codes(std::size_t map) const {
    return reinterpret_cast<std::uint16_t*>(bytes_.get() + map * stride_ + sizeof(MapRecord));
  }
  [[nodiscard]] static std::size_t stride(const ShadowMapOptions& options) {
    return sizeof(MapRecord) + (MapMaker::bytes_per_map(options) + 63) / 64 * 64;
  }

  /// Makes a map in its place.
  void make(const MapMaker& maker, LightKind kind, std::uint32_t light, int which, std::size_t map) const {
    ::new (bytes_.get() + map * stride_) MapRecord(maker.record_of(kind, light, which));
    maker.make(kind, light, which, codes(map));
  }
  void look_up(const MapMaker& maker, std::size_t map, const ReceiverPacket& receivers, std::uint32_t candidates,
               float* share) const {
    maker.look_up(receivers, candidates, *record(map), codes(map), share);
  }

 private:
  static constexpr std::size_t kPadding = 64;  // lookups read a little past the last code
  struct Free {
    void operator()(std::byte* bytes) const { ::operator delete[](bytes, std::align_val_t{64}); }
  };

  std::size_t stride_ = 0;
  std::unique_ptr<std::byte[], Free> bytes_;
};

/// Shares by a light's one or two maps; `map(which)` gives the blocks and the place of each, and is asked for the second
/// one only where it is needed, after the first was looked up.
template <class Map>
void look_up_light(const MapMaker& maker, int count, const ReceiverPacket& receivers, std::uint32_t candidates,
                   float* share, const Map& map) {
  const auto [blocks, at] = map(0);
  if (count == 1) {
    blocks->look_up(maker, at, receivers, candidates, share);
    return;
  }
  const std::uint32_t behind = behind_light(receivers, candidates, *blocks->record(at));
  blocks->look_up(maker, at, receivers, candidates & ~behind, share);
  if (behind == 0) return;
  alignas(64) float other[kPacketSize];
  const auto [other_blocks, other_at] = map(1);
  other_blocks->look_up(maker, other_at, receivers, behind, other);
  for (int lane = 0; lane < kPacketSize; ++lane) share[lane] += other[lane];
}

}  // namespace lightcuts
