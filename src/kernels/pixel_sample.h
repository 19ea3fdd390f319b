#pragma once

#include "math/sample_stream.h"

namespace lightcuts {

/// The stream of one camera sample of a pixel: group 0 places it in the pixel, paths draw the others.
LC_KERNEL SampleStream pixel_stream(std::uint64_t seed, int width, int x, int y, std::uint32_t sample) {
  const auto pixel = static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(width) + static_cast<std::uint64_t>(x);
  return {derive_seed(seed, pixel), sample, true};
}

/// A point of the picture plane [pixels] within pixel (x, y): its centre, or a point of the pixel's own
/// low-discrepancy sequence. Depends on nothing else.
LC_KERNEL Vec2 sample_position(std::uint64_t seed, int width, int x, int y, std::uint32_t sample, bool centred) {
  const Vec2 corner{static_cast<float>(x), static_cast<float>(y)};
  if (centred) return corner + Vec2{0.5f, 0.5f};
  return corner + pixel_stream(seed, width, x, y, sample).draw(0).unit2(0);
}

}  // namespace lightcuts
