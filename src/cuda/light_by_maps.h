#pragma once

#include <functional>
#include <optional>

#include "cuda/map_sum_kernels.h"
#include "cuda/shadow_maps.h"

namespace lightcuts::cuda {

/// How many maps lights have at most: every point light counted twice.
std::uint64_t most_maps(const LightArrays& lights);

/// How many maps are in memory at a time, of `all` that there are: whole blocks of lights where it is not all of them.
///
/// @param budget   bytes for points and maps
/// @param fixed    bytes that do not depend on the number of maps
/// @param per_map  bytes a map
/// Throws Error{out_of_memory} where not even one light's maps fit.
std::uint32_t plan_maps_at_once(std::uint64_t budget, std::uint64_t fixed, std::uint64_t per_map, std::uint64_t all,
                                int size);

/// Instant Radiosity with visibility by imperfect shadow maps.
///
/// Where the maps of all lights fit into the memory they are made once too; else in batches, anew
/// for each sample: a slower plan, and the same picture to the bit.
class MapLighter {
 public:
  /// Everything referred to must outlive this. `budget`: bytes of device memory for maps.
  /// Throws Error{out_of_memory} before anything large is allocated.
  MapLighter(Device& device, const DevicePoints& points, const LightArrays& lights, const MapOptions& options,
             std::uint64_t budget);

  /// Adds all lights to the pixels' sums. `go_on(done)`, done in [0, 1], is asked between batches; false where it said
  /// stop.
  bool light(const PixelGrid& grid, const PixelView& pixels, float min_distance, const SumView& sums,
             const std::function<bool(double)>& go_on);

  /// Tells of the maps of the last picture.
  void report(Statistics& statistics) const;
  [[nodiscard]] const MapOptions& options() const { return options_; }
  [[nodiscard]] std::uint64_t taken_bytes() const { return maps_->taken_bytes(); }  ///< of the device's memory
  [[nodiscard]] std::uint64_t made() const { return made_; }                        ///< since it was built
  [[nodiscard]] double making_ms() const { return milliseconds_; }                  ///< since it was built

 private:
  void make(const LightSpan& span);
  [[nodiscard]] LightSpan next_span(const LightSpan& before) const;

  Device* device_;
  const DevicePoints* points_;
  LightArrays lights_;
  MapOptions options_;
  bool all_made_ = false;
  std::uint64_t made_ = 0, looked_up_ = 0, rounds_ = 0;
  double milliseconds_ = 0;
  std::optional<DeviceMaps> maps_;
};

}  // namespace lightcuts::cuda
