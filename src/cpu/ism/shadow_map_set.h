#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "cpu/ism/surface_points.h"
#include "cpu/light_set.h"
#include "cpu/simd/ism_kernels.h"
#include "cpu/visibility.h"
#include "lightcuts/render.h"

namespace lightcuts {

class Progress;

/// How maps are made.
struct ShadowMapOptions {
  int size = 64;        ///< texels a side
  int depth_bits = 16;  ///< 16 or 32
  int levels = 2;       ///< of pull and push, 0: holes stay
  HoleFill fill = HoleFill::edges;
  PointChoice choice = PointChoice::block;
  std::uint64_t seed = 1;
};

/// Lights of each kind by their index in Lights, ascending, each once.
struct LightIds {
  std::vector<std::uint32_t> vpls, points, directionals;
};

/// Every `stride`-th light of each kind, from `offset` on.
LightIds every_light(const LightSet& lights, std::size_t offset = 0, std::size_t stride = 1);

/// Imperfect shadow maps of some of the lights.
///
/// A VPL and a directional light have one map, a point light two (one for each hemisphere; a spot of less than a
/// hemisphere one). A map depends on its light, the points and the options only: not on which others are made with
/// it, nor on threads. All maps lie in one array, map i at i * size^2 codes.
class ShadowMapSet {
 public:
  /// Everything referred to must outlive this; lights must not change between `add` and lookups.
  ShadowMapSet(const IsmKernels& kernels, const SurfacePoints& points, const LightSet& lights,
               const ShadowMapOptions& options);
  ~ShadowMapSet();
  ShadowMapSet(const ShadowMapSet&) = delete;
  ShadowMapSet& operator=(const ShadowMapSet&) = delete;

  /// Makes the maps of those lights that have none yet, in parallel. Returns false if `progress` asked to stop; then
  /// the set is empty. `progress` is told of 1 unit a map and may be null.
  bool add(const LightIds& ids, Progress* progress = nullptr);
  /// Forgets all maps but keeps their memory.
  void clear();

  /// Reserves addresses, not memory, for the maps of all lights, so that `make_missing` may be called; after that `add`
  /// must not be. What is never made takes no memory.
  void reserve_all();
  /// Makes the maps of a light unless they are there. Threads may call it at once; one makes them, the others wait.
  void make_missing(LightKind kind, std::uint32_t light);

  /// Share of the light that arrives at each of 16 receivers (aligned to 64 bytes); 1 for a light without a map.
  void shares(LightKind kind, std::uint32_t light, const ReceiverPacket& receivers, float* share) const;

  [[nodiscard]] bool has(LightKind kind, std::uint32_t light) const { return slots(kind)[light] != kNone; }
  /// How many maps there are, and how many bytes they take.
  [[nodiscard]] std::size_t map_count() const { return ready_ == nullptr ? map_count_ : made_.load(); }
  [[nodiscard]] std::uint64_t bytes() const { return map_count() * bytes_per_map(options_); }
  [[nodiscard]] static std::uint64_t bytes_per_map(const ShadowMapOptions& options);
  /// Maps that all lights together would have.
  [[nodiscard]] static std::uint64_t maps_of(const LightSet& lights);
  [[nodiscard]] const ShadowMapOptions& options() const { return options_; }

  /// How a map of a light looks at the scene; `which` 1: the second hemisphere of a point light.
  [[nodiscard]] MapView view_of(LightKind kind, std::uint32_t light, int which = 0) const;
  /// The code of every texel of a light's map, 16-bit ones widened; for tests and pictures.
  [[nodiscard]] std::vector<std::uint32_t> codes_of(LightKind kind, std::uint32_t light, int which = 0) const;

 private:
  struct Order;
  struct Scratch;

  [[nodiscard]] std::size_t texels() const;
  [[nodiscard]] std::uint16_t* codes_at(std::size_t slot) const;
  void grow(std::size_t maps);
  Scratch& scratch();
  [[nodiscard]] const std::vector<std::uint32_t>& slots(LightKind kind) const {
    return slots_[static_cast<std::size_t>(kind)];
  }
  [[nodiscard]] int maps_for(LightKind kind, std::uint32_t light) const;
  void place(LightKind kind, const std::vector<std::uint32_t>& ids, std::vector<Order>& orders);
  void draw(const Order& order, const MapView& view, Scratch& scratch) const;
  void make(const Order& order, Scratch& scratch);
  [[nodiscard]] DepthCodes map_at(std::size_t slot) const;

  const IsmKernels& kernels_;
  const SurfacePoints& points_;
  const LightSet& lights_;
  ShadowMapOptions options_;
  std::vector<std::uint32_t> slots_[3];  ///< by LightKind, then by light: its first map
  std::size_t map_count_ = 0;
  std::unique_ptr<std::uint16_t[]> codes_;  ///< codes of 32 bits take two entries each
  std::size_t capacity_ = 0;                ///< maps that fit into codes_

  enum State : std::uint8_t { missing, in_work, ready };
  std::unique_ptr<std::atomic<State>[]> ready_;  ///< by map, where maps are made when they are needed
  std::atomic<std::size_t> made_{0};
  tbb::enumerable_thread_specific<std::unique_ptr<Scratch>> scratch_;
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

/// The same, with maps that are made when they are first looked up: only for lights that some pixel's cut asks for.
class ShadowMapsOnDemand final : public PacketVisibility {
 public:
  /// The set must outlive this; its `reserve_all` must have been called.
  explicit ShadowMapsOnDemand(ShadowMapSet& maps) : maps_(maps) {}
  std::uint32_t shares(const VisibilityQuery& query, float* share) const override;

 private:
  ShadowMapSet& maps_;
};

}  // namespace lightcuts
