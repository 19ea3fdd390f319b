#pragma once

#include <cstdint>

#include "cuda/packet_cut.h"

namespace lightcuts::cuda {

/// An order of groups of pixels in which none that takes long is among the last.
///
/// Costs are those of the picture before, or what earlier walks of this one found; without any, groups stay as they
/// are.
class GroupOrder {
 public:
  /// For a picture of so many tiles.
  void begin(Device& device, std::uint32_t tile_count);
  /// CutView::cost, for kernels to write.
  [[nodiscard]] std::uint32_t* cost() const { return now_.data(); }
  /// The list with those groups first that cost most, about; valid until the next call. Equally dear ones stay
  /// together, as neighbours read the same nodes.
  GroupList sorted(Device& device, const GroupList& list);
  /// From here on costs of this picture count.
  void use_this_picture() { known_ = now_.data(); }
  /// Keeps this picture's costs for the next.
  void end();

 private:
  DeviceBuffer<std::uint32_t> before_, now_, groups_;
  const std::uint32_t* known_ = nullptr;
};

}  // namespace lightcuts::cuda
