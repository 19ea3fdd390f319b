#pragma once

#include <cstdint>
#include <vector>

#include "bench.h"

namespace lightcuts::app::study {

/// How large everything is, by the scale asked for.
struct Sizes {
  const char* name;
  int repeats;                            ///< of a timing, at most
  double budget_s;                        ///< longest time of one measurement
  std::vector<std::uint64_t> vpl_counts;  ///< table 1
  int cut_side;                           ///< tables 2 and 3: pixels a side
  std::vector<std::uint64_t> cut_lights;  ///< n of n + n^2
  std::vector<int> cut_seeds;             ///< for each of these
  std::vector<int> atlas_maps;            ///< table 4: maps of 128x128 a side
  int frame_side;                         ///< table 5
  std::vector<std::uint64_t> frame_lights;
  std::vector<std::uint64_t> software_lights;  ///< table 6
  std::vector<int> software_sides;             ///< 50, and beyond
  bool all_published;                          ///< table 6's published rows are repeated however long they take
  int picture_side, picture_samples;           ///< pictures: pixels a side, paths a pixel of the reference
  std::uint64_t picture_vpls;
  int converge_side, converge_samples;
  std::vector<std::uint64_t> converge_vpls;
  std::vector<int> converge_paths;
  std::vector<std::uint64_t> stage_vpls;
  int stage_side;
};

const Sizes& sizes_of(BenchScale scale);

}  // namespace lightcuts::app::study
