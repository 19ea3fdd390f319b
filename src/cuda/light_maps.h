#pragma once

#include <functional>
#include <optional>

#include "cuda/light_tree.h"
#include "cuda/shadow_maps.h"

namespace lightcuts::cuda {

/// Of no more lights than this all get maps at once, if these are of 32x32 texels and 2000 points, or of fewer lights
/// if they are larger: to draw them takes 0.7 ms on an H100, to find out which are wanted longer.
inline constexpr std::uint32_t kFewLights = 16384;

/// Lights whose shadow maps a kernel asked for and did not find.
struct WantedMaps {
  std::uint32_t* bits[kKinds] = {};  ///< a bit a light
#if defined(__CUDACC__)
  __device__ void mark(int kind, std::uint32_t light) const {
    std::uint32_t* const word = &bits[kind][light / 32];
    const std::uint32_t bit = 1u << light % 32;
    if ((*word & bit) == 0) atomicOr(word, bit);
  }
#endif
};

/// Steps in which shares are remembered.
inline constexpr float kShareSteps = 255;

/// What arrives of lights at one tile's pixels, looked up before in maps that are gone: in kShareSteps, 32 to a row.
struct ShareTable {
  const std::uint32_t* rows[kKinds] = {};  ///< of each light, kNone: not looked up; null: there is no table
  const std::uint8_t* shares = nullptr;
#if defined(__CUDACC__)
  __device__ std::uint32_t row(int kind, std::uint32_t light) const {
    return rows[kind] == nullptr ? kNone : rows[kind][light];
  }
  __device__ float share(std::uint32_t row, std::uint32_t lane) const {
    return static_cast<float>(shares[std::size_t{32} * row + lane]) * (1 / kShareSteps);
  }
#endif
};

/// Shadow maps of those lights that were asked for, within a budget; on the device.
///
/// Which lights have maps depends on what was asked for before, but a light's map never does.
class LightMaps {
 public:
  /// Everything referred to must outlive this. `budget`: bytes of device memory for maps and lists of them.
  /// Throws Error{out_of_memory} where not even one light's maps fit.
  LightMaps(Device& device, const DevicePoints& points, const MapOptions& options, const LightArrays& lights,
            std::uint64_t budget);

  [[nodiscard]] const MapSetView& view() const { return maps_->view(); }
  [[nodiscard]] WantedMaps wanted();

  /// Makes the maps that are wanted, and forgets the wishes; false where there is no room for them: none is made then.
  bool add_wanted();
  /// Makes the first maps, once until other trees or lights are announced: of the trees' upper levels, or of all lights
  /// where they are so few that to find out which are wanted would take longer. False where there is no room for them.
  bool add_first(const TreeViews& trees);
  /// Whether hardly any of the maps that will be wanted are there.
  [[nodiscard]] bool has_hardly_any() const { return !has_all_ && maps_->count() - dead_ <= first_maps_; }
  void trees_changed() { has_first_ = false; }
  /// Takes other lights, as many of each kind; see DeviceMaps::replace_lights.
  void replace_lights(const LightArrays& lights);
  /// Forgets all maps.
  void clear();

  // One tile of which the maps do not fit all at once.
  using FillShares = std::function<void(const std::uint32_t* ids, std::uint32_t count, int kind, std::uint8_t* shares)>;
  /// Takes the wishes, and the trees' upper levels, into the table: some maps at a time, which `fill` looks up before
  /// they are forgotten. Throws Error{out_of_memory} where the table does not fit.
  void look_up_wanted(const TreeViews& trees, const FillShares& fill);
  [[nodiscard]] const ShareTable& table() const { return table_; }
  void forget_table();

  /// From now on; returns false, and changes nothing, where more than that is taken already.
  bool set_budget(std::uint64_t budget);
  [[nodiscard]] std::uint64_t taken_bytes() const;  ///< of the device's memory
  [[nodiscard]] const MapOptions& options() const { return options_; }

  [[nodiscard]] std::uint32_t count() const { return maps_->count(); }
  /// Tells how many maps there are; the caller tells of rounds and times.
  void report(Statistics& statistics) const;
  [[nodiscard]] std::uint64_t bytes() const { return std::uint64_t{most_} * DeviceMaps::codes_per_map_bytes(options_); }
  [[nodiscard]] std::uint32_t room() const { return room_; }
  [[nodiscard]] std::uint64_t made() const { return made_; }  ///< since it was built
  [[nodiscard]] double making_ms() const { return milliseconds_; }
  [[nodiscard]] int size() const { return options_.size; }

  /// Bytes beside the maps themselves.
  static std::uint64_t fixed_bytes(const Device& device, const MapOptions& options, const LightArrays& lights);

 private:
  [[nodiscard]] bool is_few() const;
  [[nodiscard]] std::uint32_t plan_room(std::uint64_t budget) const;
  bool make_room(std::uint64_t maps);

  void want_all();
  void want_upper_levels(const TreeViews& trees);
  std::uint32_t list_wanted(int kind, DeviceBuffer<std::uint32_t>& ids);

  bool has_first_ = false, has_all_ = false;
  std::uint32_t first_maps_ = 0;  ///< made by add_first when there were none
  std::uint32_t dead_ = 0;        ///< places of maps of lights that moved
  DeviceBuffer<std::uint32_t> rows_;
  DeviceBuffer<std::uint8_t> shares_;
  std::uint32_t row_count_ = 0;
  ShareTable table_;
  Device* device_;
  const DevicePoints* points_;
  MapOptions options_;
  LightArrays lights_;
  std::uint64_t budget_;
  std::uint32_t room_ = 0;  ///< maps that may be there at a time
  std::uint32_t most_ = 0;  ///< maps that were there at a time
  std::uint64_t made_ = 0;
  double milliseconds_ = 0;
  std::optional<DeviceMaps> maps_;
  DeviceBuffer<std::uint32_t> wanted_[kKinds];
};

}  // namespace lightcuts::cuda
