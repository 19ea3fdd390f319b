#pragma once

#include <cstdint>
#include <vector>

#include "kernels/placement.h"
#include "lightcuts/render.h"

namespace lightcuts {

// Camera-aware placement, the part that every backend does alike: many more candidates than VPLs wanted are traced as
// ever, each one's worth for what the camera sees is measured, and each is kept with a probability in proportion to it,
// its flux divided by that. Given the candidates, the expected light of the kept ones is that of all candidates whatever
// the probabilities were, so nothing is biased and the number kept can be fixed.
// Source: Segovia et al. 2006 (resampling); Georgiev and Slusallek 2010 (acceptance by the contribution to the image).

/// Candidates that are traced for `wanted` VPLs: sixteen for each, fewer for millions.
std::uint64_t placement_candidates(std::uint64_t wanted);

/// Every so many of the lights tell how bright the points are.
inline constexpr std::uint32_t kPlacementStride = 16;

/// The grid of points for a picture: about 256, by its shape.
PlacementGrid make_placement_grid(int width, int height);

/// Nearer candidates than this are rated as if they were this far [m]: the points stand for surfaces around them.
float placement_clamp(float min_distance, float diagonal);

/// Weight of each point in the worth of a candidate, from the luminance [W/(m^2 sr)] that comes from it in all. One over
/// the scale of `relmse`, so that worth counts what matters for the relative error; 0 where there is no surface.
std::vector<float> placement_weights(const std::vector<PlacementPoint>& points, const std::vector<double>& radiance);

/// The candidates along a curve through space, area-light samples first, then VPLs, then samples of the sky.
std::vector<std::uint32_t> placement_order(const Lights& lights);

/// A candidate that is kept.
struct KeptLight {
  std::uint32_t index = 0;
  float weight = 1;  ///< one over the probability with which it was kept
};

/// Keeps `wanted` candidates, or one more or fewer, by their index: all where there are no more.
///
/// The probability is proportional to the worth (any unit, 0 or more) plus a share of the mean worth, at most 1. The best
/// choice for worth w_i = the root mean square over the points of the candidate's relative contributions: it minimises
/// the sum of the points' relative variances, sum w_i^2 / p_i, at a given sum of the p_i. The share bounds the weights, so
/// that a light that no point saw is no firefly for what lies between the points. `start` in [0, 1), uniform: the only
/// random number, for candidates are taken at even steps along the sum of
/// probabilities in the given order, so that the kept ones are spread as evenly as their worth allows.
std::vector<KeptLight> keep_by_worth(const std::vector<float>& worth, const std::vector<std::uint32_t>& order,
                                     std::uint64_t wanted, double start);

/// The choice for these options: options.count of the lights that `worth` rates.
std::vector<KeptLight> choose_for_camera(const std::vector<float>& worth, const Lights& lights,
                                         const VplOptions& options);

/// Leaves only the kept ones of the VPLs and sky samples, each times its weight; other lights stay.
void keep_lights(const std::vector<KeptLight>& kept, Lights& lights);

}  // namespace lightcuts
