#pragma once

#include "cuda/device.h"
#include "cuda/sum_kernels.h"
#include "kernels/map_lookup.h"

namespace lightcuts::cuda {

/// Lights of each kind, from `first` to before `last`.
struct LightSpan {
  std::uint32_t vpl_first = 0, vpl_last = 0;
  std::uint32_t point_first = 0, point_last = 0;
  std::uint32_t directional_first = 0, directional_last = 0;
};

/// Lights that are summed in single precision before they go into a total in double.
inline constexpr std::uint32_t kSumBlockLights = 320;

/// What adding lights takes at most, beside their maps.
inline constexpr std::uint64_t kSumByMapsBytes = std::uint64_t{80} << 13;

/// Adds the lights of a span to every pixel, as much of them as their maps let pass: brute force.
///
/// Lights are taken in launches that keep no display waiting. They are summed in blocks of kSumBlockLights from the span's
/// first on: spans that begin at multiples of it give the same bits as one span of all.
void sum_lights_by_maps(Device& device, const PixelGrid& grid, const PixelView& pixels, const LightArrays& lights,
                        const LightSpan& span, const MapSetView& maps, float min_distance, const SumView& sums);

}  // namespace lightcuts::cuda
