#pragma once

#include <cstdint>
#include <vector>

#include "bench.h"

namespace lightcuts::app::frame {

/// How large everything is, by the scale asked for.
struct Sizes {
  int side;                                 ///< of the picture [pixels]
  int runs;                                 ///< of a measurement, at most
  std::vector<std::uint64_t> vpls;          ///< for every stage
  std::vector<std::uint64_t> study_lights;  ///< the study's numbers, for heap and brute force
  std::vector<std::uint64_t> more_lights;   ///< between and beyond, for curves
  std::uint64_t map_lights;                 ///< whose maps are made
  std::uint64_t most_crossing;              ///< up to which cuts are asked whether they beat all lights
  std::uint32_t rays;                       ///< from anywhere
  double longest_s;                         ///< runs of one measurement end after this
};

Sizes sizes_of(BenchScale scale);

}  // namespace lightcuts::app::frame
