#pragma once

#include <cstdint>

#include "cuda/device.h"
#include "cuda/sum_kernels.h"
#include "cuda/surface_points.h"
#include "kernels/map_lookup.h"
#include "lightcuts/render.h"

namespace lightcuts::cuda {

/// How maps are made; as ShadowMapOptions of the CPU.
struct MapOptions {
  int size = 64;        ///< texels a side, a power of two from 4 on
  int depth_bits = 16;  ///< 16 or 32
  int levels = 2;       ///< of pull and push, 0: holes stay
  HoleFill fill = HoleFill::edges;
  PointChoice choice = PointChoice::block;
  std::uint64_t seed = 1;
  int threads = 0;  ///< that draw a map, a multiple of 32; 0: the best measured

  bool operator==(const MapOptions&) const = default;
};
MapOptions map_options(const ShadeOptions& options);

/// Lights of one kind: those that `ids` names (in the device's memory), or, where it is null, those from `first` on.
struct LightRange {
  const std::uint32_t* ids = nullptr;
  std::uint32_t first = 0, count = 0;
};

/// Imperfect shadow maps in a device's memory.
///
/// A map depends on its light, the points and the options only; not on which others are made with it. One block of
/// threads draws a map in shared memory (in a scratch of its own in global memory where it does not fit), keeps the
/// largest nearness by whole-number maxima, so that the order of threads is of no account, fills its holes there and
/// writes it once.
class DeviceMaps {
 public:
  /// Takes memory for `capacity` maps of lights of a set. Throws Error{out_of_memory}.
  DeviceMaps(Device& device, const MapOptions& options, const LightArrays& lights, std::uint32_t capacity);

  /// Forgets all maps but keeps their memory.
  void clear();
  /// Takes memory for so many maps; what there are stay, and both old and new memory are taken for a moment.
  void grow(std::uint32_t capacity);
  /// Forgets all maps and takes memory for so many, after giving back the old.
  void renew(std::uint32_t capacity);

  /// Takes other lights in the place of those that there were, as many of each kind: maps of those that stand where
  /// they stood, and look where they looked, stay. Returns how many maps were forgotten, whose places stay taken.
  std::uint32_t replace_lights(const LightArrays& lights);

  // Make the maps of lights that have none yet; each light once. There must be room for them.
  void add_vpls(const PointsView& points, const LightRange& range);
  void add_points(const PointsView& points, const LightRange& range);
  void add_directionals(const PointsView& points, const LightRange& range);

  [[nodiscard]] const MapSetView& view() const { return view_; }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] std::uint32_t capacity() const { return capacity_; }
  [[nodiscard]] std::uint64_t bytes() const { return count_ * codes_per_map_bytes(options_); }

  /// Of the device's memory that is taken.
  [[nodiscard]] std::uint64_t taken_bytes() const {
    return slots_.bytes() + records_.bytes() + streams_.bytes() + codes_.bytes() + scratch_.bytes();
  }

  static std::uint64_t codes_per_map_bytes(const MapOptions& options);
  /// All that a map takes, and all that the set takes beside its maps.
  static std::uint64_t bytes_per_map(const MapOptions& options);
  static std::uint64_t fixed_bytes(const Device& device, const MapOptions& options, const LightArrays& lights);

 private:
  template <class Source>
  void add(const PointsView& points, const LightRange& range, const Source& source);
  void draw(const PointsView& points, std::uint32_t first, std::uint32_t count, bool paraboloid);

  Device* device_;
  MapOptions options_;
  LightArrays lights_;
  std::uint32_t capacity_ = 0, count_ = 0;
  DeviceBuffer<std::uint32_t> slots_;  ///< of all VPLs, then points, then directional lights
  DeviceBuffer<MapRecord> records_;
  DeviceBuffer<std::uint32_t> streams_;
  DeviceBuffer<std::uint32_t> codes_;
  DeviceBuffer<std::uint32_t> scratch_;
  MapSetView view_;
};

}  // namespace lightcuts::cuda
