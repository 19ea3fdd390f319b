#pragma once

#include <cstdint>

#include "lightcuts/render.h"

namespace lightcuts {

// What every backend decides alike before it traces light paths: how many samples of each kind of emitter, from which
// streams, and how many paths.

/// Streams of their own, derived from the seed.
enum VplPurpose : std::uint64_t {
  area_samples = 1,
  sky_samples = 2,
  punctual_samples = 3,
  pilot_paths = 4,
  vpl_thinning = 5,
  placement_points = 6,
  placement_choice = 7
};

/// Number of samples of each kind of emitter. Every kind with power gets at least one.
struct VplShares {
  std::uint64_t area = 0, punctual = 0, sky = 0;
  [[nodiscard]] std::uint64_t total() const { return area + punctual + sky; }
};
VplShares share_by_power(std::uint64_t n, double area, double punctual, double sky);

/// What paths that are not used for anything else tell of the number of VPLs that a path leaves.
struct VplPilot {
  double paths = 0;
  double yield = 0;   ///< mean number
  double spread = 0;  ///< its standard deviation over its mean
};
/// Paths a pilot takes to plan for `wanted` VPLs.
std::uint64_t pilot_path_count(std::uint64_t wanted);
VplPilot make_pilot(std::uint64_t paths, double sum, double sum_sq);

/// Number of paths that will leave at least 96 % of `wanted` VPLs, but for one case in a thousand.
std::uint64_t paths_for(std::uint64_t wanted, const VplPilot& flown);

/// True where so many more VPLs came than were wanted that the rest has to be dropped at random.
bool needs_thinning(std::uint64_t made, std::uint64_t wanted);

/// Throws Error{invalid_argument} for options that contradict each other or cannot be met.
void check_vpl_options(const VplOptions& options);

}  // namespace lightcuts
