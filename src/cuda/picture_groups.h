#pragma once

#include "cuda/packet_cut.h"

namespace lightcuts::cuda {

/// The groups that the pixels of a picture's tiles form, each on one surface.
class PictureGroups {
 public:
  /// Waits for the device.
  PictureGroups(Device& device, const PixelView& pixels, std::uint32_t tile_count);

  /// CutJob::groups.
  [[nodiscard]] const std::uint32_t* pixels() const { return pixels_.data(); }
  /// Those that exist, and the first group of each tile in any case; in about the order of tiles.
  [[nodiscard]] GroupList list() const { return {list_.data(), count_}; }

 private:
  DeviceBuffer<std::uint32_t> pixels_, list_;
  std::uint32_t count_ = 0;
};

}  // namespace lightcuts::cuda
