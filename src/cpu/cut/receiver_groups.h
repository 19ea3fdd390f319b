#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cpu/tile.h"
#include "kernels/group_bound.h"

namespace lightcuts {

/// Pixels that choose one cut together, laid side by side anew.
struct PixelGroup {
  std::uint8_t pixels[kTilePixels];  ///< packet * kPacketSize + lane, of the tile that they come from
  int count = 0;
};

/// How alike the pixels of a group are.
struct GroupLimits {
  float extent;  ///< largest diagonal of the box of their positions [m]
  float cosine;  ///< smallest cosine between a normal and the normals' axis
  int pixels;    ///< most pixels
};

/// Splits the pixels with a surface into groups within the limits: halves of what differs most, until they fit. Depends
/// on the pixels alone.
std::vector<PixelGroup> group_pixels(std::span<const SurfacePacket> packets, const GroupLimits& limits);

/// Box and cone of the receivers of a group.
ReceiverGroup<float> bound_receivers(std::span<const SurfacePacket> packets, const PixelGroup& group);

}  // namespace lightcuts
