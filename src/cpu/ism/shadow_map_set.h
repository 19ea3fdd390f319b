#pragma once

#include <cstdint>
#include <vector>

#include "cpu/ism/map_blocks.h"
#include "cpu/visibility.h"

namespace lightcuts {

class Progress;

/// Lights of each kind by their index in Lights, ascending, each once.
struct LightIds {
  std::vector<std::uint32_t> vpls, points, directionals;
};

/// Every `stride`-th light of each kind, from `offset` on.
LightIds every_light(const LightSet& lights, std::size_t offset = 0, std::size_t stride = 1);

/// Imperfect shadow maps of some of the lights: of a batch, for Instant Radiosity.
class ShadowMapSet {
 public:
  /// Everything referred to must outlive this; lights must not change between `add` and lookups.
  ShadowMapSet(const IsmKernels& kernels, const SurfacePoints& points, const LightSet& lights,
               const ShadowMapOptions& options);

  /// Makes the maps of those lights that have none yet, in parallel. Returns false if `progress` asked to stop; then
  /// the set is empty. `progress` is told of 1 unit a map and may be null.
  bool add(const LightIds& ids, Progress* progress = nullptr);
  /// Forgets all maps but keeps their memory.
  void clear();

  /// Share of the light that arrives at each of 16 receivers (aligned to 64 bytes), 0 for those that are no candidates;
  /// 1 for a light without a map.
  void shares(LightKind kind, std::uint32_t light, const ReceiverPacket& receivers, std::uint32_t candidates,
              float* share) const;

  [[nodiscard]] bool has(LightKind kind, std::uint32_t light) const { return slots(kind)[light] != kNone; }
  /// How many maps there are, and how many bytes they take.
  [[nodiscard]] std::size_t map_count() const { return map_count_; }
  [[nodiscard]] std::uint64_t bytes() const { return map_count_ * maker_.bytes_per_map(); }
  [[nodiscard]] const MapMaker& maker() const { return maker_; }

  /// The code of every texel of a light's map, 16-bit ones widened; for tests and pictures.
  [[nodiscard]] std::vector<std::uint32_t> codes_of(LightKind kind, std::uint32_t light, int which = 0) const;
  [[nodiscard]] MapView view_of(LightKind kind, std::uint32_t light, int which = 0) const {
    return maker_.view_of(kind, light, which);
  }

 private:
  struct Order;

  void grow(std::size_t maps);
  [[nodiscard]] const std::vector<std::uint32_t>& slots(LightKind kind) const {
    return slots_[static_cast<std::size_t>(kind)];
  }
  void place(LightKind kind, const std::vector<std::uint32_t>& ids, std::vector<Order>& orders);

  MapMaker maker_;
  std::vector<std::uint32_t> slots_[3];  ///< by LightKind, then by light: its first map
  std::size_t map_count_ = 0;
  MapBlocks blocks_;
  std::size_t capacity_ = 0;  ///< maps that fit into blocks_
};

/// Visibility by lookups in shadow maps.
class ShadowMapVisibility final : public PacketVisibility {
 public:
  /// The set must outlive this.
  explicit ShadowMapVisibility(const ShadowMapSet& maps) : maps_(maps) {}
  std::uint32_t shares(const VisibilityQuery& query, float* share) const override;

 private:
  const ShadowMapSet& maps_;
};

}  // namespace lightcuts
