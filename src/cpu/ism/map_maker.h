#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "cpu/ism/surface_points.h"
#include "cpu/light_set.h"
#include "cpu/simd/ism_kernels.h"
#include "cpu/visibility.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// How maps are made.
struct ShadowMapOptions {
  int size = 64;        ///< texels a side
  int depth_bits = 16;  ///< 16 or 32
  int levels = 2;       ///< of pull and push, 0: holes stay
  HoleFill fill = HoleFill::edges;
  PointChoice choice = PointChoice::block;
  std::uint64_t seed = 1;

  bool operator==(const ShadowMapOptions&) const = default;
};

/// Makes single maps.
///
/// A VPL and a directional light have one map, a point light two (one for each hemisphere; a spot of less than a
/// hemisphere one). A map depends on its light, the points and the options only.
class MapMaker {
 public:
  /// Everything referred to must outlive this; lights must not change.
  MapMaker(const IsmKernels& kernels, const SurfacePoints& points, const LightSet& lights,
           const ShadowMapOptions& options);
  ~MapMaker();

  /// Draws a map and fills its holes: size^2 codes. Called by many threads at once.
  void make(LightKind kind, std::uint32_t light, int which, void* codes) const;

  [[nodiscard]] int maps_for(LightKind kind, std::uint32_t light) const;
  /// How a map of a light looks at the scene; `which` 1: the second hemisphere of a point light.
  [[nodiscard]] MapView view_of(LightKind kind, std::uint32_t light, int which = 0) const;
  /// The same as lookups read it.
  [[nodiscard]] MapRecord record_of(LightKind kind, std::uint32_t light, int which = 0) const;

  /// Share of light that arrives at receivers by one map; see IsmKernels::look_up.
  void look_up(const ReceiverPacket& receivers, std::uint32_t candidates, const MapRecord& record, const void* codes,
               float* share) const {
    kernels_.look_up(receivers, candidates, record, {codes, options_.size, options_.depth_bits}, share);
  }

  /// The same for a flat group of receivers, of up to 16 maps of VPLs; see IsmKernels::look_up_group.
  void look_up_group(const FlatReceivers& receivers, const GroupMap* maps, int count, float* share) const {
    kernels_.look_up_group(receivers, maps, count, options_.size, share);
  }

  [[nodiscard]] const ShadowMapOptions& options() const { return options_; }
  [[nodiscard]] const LightSet& lights() const { return lights_; }
  [[nodiscard]] std::uint64_t bytes_per_map() const { return bytes_per_map(options_); }
  [[nodiscard]] static std::uint64_t bytes_per_map(const ShadowMapOptions& options);
  /// Maps that all lights together would have.
  [[nodiscard]] static std::uint64_t maps_of(const LightSet& lights);

 private:
  struct Scratch;

  Scratch& scratch() const;
  void draw(LightKind kind, std::uint32_t light, const MapView& view, Scratch& scratch) const;

  const IsmKernels& kernels_;
  const SurfacePoints& points_;
  const LightSet& lights_;
  ShadowMapOptions options_;
  mutable tbb::enumerable_thread_specific<std::unique_ptr<Scratch>> scratch_;
};

/// Receivers on the far side of a light that has two maps, as bits.
std::uint32_t behind_light(const ReceiverPacket& receivers, std::uint32_t candidates, const MapRecord& front);

}  // namespace lightcuts
