#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "cpu/ism/map_blocks.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/visibility.h"

namespace lightcuts {

/// Thrown by a lookup whose map finds no room in the pool; whoever lights tiles waits for the others, clears the pool
/// and lights the tile again.
struct PoolIsFull {};

/// Visibility by maps that are made when they are first looked up: only for lights that some pixel's cut asks for.
///
/// Room for a number of maps is planned, memory taken as maps are made. Since a map depends on its light only, neither
/// the order in which threads ask nor a pool that is too small changes any share.
class ShadowMapPool final : public PacketVisibility {
 public:
  /// The maker must outlive this.
  /// @param room     maps at most; at least 2 for each of `threads`
  /// @param threads  that may look up at once
  ShadowMapPool(const MapMaker& maker, std::size_t room, int threads);

  /// Throws PoolIsFull. A thread that needs a map which another is making waits for it.
  std::uint32_t shares(const VisibilityQuery& query, float* share) const override;
  [[nodiscard]] bool leaks() const override { return true; }
  [[nodiscard]] bool knows_groups() const override { return maker_.options().depth_bits == 16; }
  void group_shares(const FlatReceivers& receivers, std::span<const std::uint32_t> vpls, float* share) const override;

  // Between lookups of all threads:

  /// Forgets all maps but keeps their memory.
  void clear();
  /// Forgets the maps of some lights. The places of point lights stay taken until all are forgotten.
  void forget(const LightIds& ids);
  /// Plans for another number of maps; false, and nothing changed, where those that are there would not fit.
  bool change_room(std::size_t room);
  /// Counts anew what was made; the room is no longer divided.
  void begin_picture();
  /// From now on the room is divided among the threads, each of which replaces its own maps: slower, and never full.
  void divide();
  [[nodiscard]] bool divided() const { return divided_; }

  [[nodiscard]] std::size_t room() const { return room_; }
  /// No lookup of any light will throw.
  [[nodiscard]] bool has_room_for_all() const { return room_ >= MapMaker::maps_of(maker_.lights()) + lost_; }
  [[nodiscard]] std::uint64_t bytes() const;                       ///< taken by maps
  [[nodiscard]] std::size_t made() const { return made_.load(); }  ///< maps, those made again counted again
  [[nodiscard]] std::size_t most() const;                          ///< maps that were there at a time
  [[nodiscard]] double making_ms() const { return 1e-6 * static_cast<double>(making_ns_.load()); }  ///< of all threads

  /// Bytes a map, with what is kept beside it; and for a light.
  [[nodiscard]] static std::uint64_t bytes_per_map(const ShadowMapOptions& options) {
    return MapBlocks::stride(options);
  }
  static constexpr std::uint64_t kBytesPerLight = sizeof(std::uint32_t);

 private:
  struct Place {
    const MapBlocks* blocks;
    std::size_t at;
  };
  using Slot = std::atomic<std::uint32_t>;
  static constexpr std::size_t kChunk = 64;  ///< maps whose memory is taken together

  [[nodiscard]] Slot& slot_of(LightKind kind, std::uint32_t light) const {
    return slots_[static_cast<std::size_t>(kind)][light];
  }
  /// The slot of a light's first map, which is made if it is missing.
  std::uint32_t first_map(LightKind kind, std::uint32_t light) const;
  std::uint32_t obtain(LightKind kind, std::uint32_t light, Slot& slot) const;
  std::uint32_t take(int count) const;
  [[nodiscard]] Place place_of(std::size_t map) const;
  [[nodiscard]] Place own_map(LightKind kind, std::uint32_t light, int which) const;
  void make(LightKind kind, std::uint32_t light, int which, Place place) const;

  const MapMaker& maker_;
  std::size_t room_, threads_;
  bool divided_ = false;
  std::unique_ptr<Slot[]> slots_[3];  ///< by LightKind, then by light: its first map, or one of two words
  mutable std::vector<MapBlocks> chunks_;
  mutable std::unique_ptr<std::atomic<bool>[]> chunk_there_;
  mutable std::mutex chunk_mutex_;
  mutable std::atomic<std::size_t> taken_{0}, made_{0};
  std::vector<std::uint32_t> free_;  ///< places of forgotten maps
  mutable std::atomic<std::size_t> free_taken_{0};
  mutable std::atomic<std::uint64_t> making_ns_{0};
  mutable std::vector<std::uint64_t> owner_;  ///< divided: which map of which light each place holds
  std::size_t most_ = 0;
  std::size_t lost_ = 0;  ///< places of forgotten maps that are not free
};

}  // namespace lightcuts
