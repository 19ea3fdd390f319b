#pragma once

#include <cstddef>
#include <vector>

#include "lightcuts/image.h"

namespace lightcuts {

/// How far an image A is from its reference B. m is the mean luminance of B.
///
/// Where B is black all over (m <= 0) the relative measures are 0 if A equals B, else infinite.
struct Comparison {
  double rmse = 0;    ///< square root of the mean over pixels and channels of (a - b)^2
  double relmse = 0;  ///< mean over pixels and channels of (a - b)^2 / (b^2 + 0.01 m^2)
  // Of luminance, over the pixels of B that are not darker than 1 % of m.
  double mean_relative_error = 0;    ///< mean of |a - b| / b
  double p99_relative_error = 0;     ///< 99th percentile of |a - b| / b, linear between ranks
  double signed_relative_error = 0;  ///< mean of (a - b) / b: above zero where A is brighter
  /// Mean of |a - b| / max(b, 0.01 m) of red, green and blue by themselves, over the same pixels.
  double channel_relative_error[3] = {};
  double flip = 0;              ///< mean of `flip_map`
  float exposure_ev = 0;        ///< what auto_exposure chose for B, used for FLIP
  std::size_t dark_pixels = 0;  ///< pixels left out of the relative errors of luminance
  std::vector<float> flip_map;  ///< FLIP error of each pixel, 0 to 1
};

/// Compares the colour of an image with that of a reference.
///
/// FLIP is taken at 67 pixels a degree between both images at the exposure that auto_exposure chooses for the
/// reference, clamped to [0, 1], in sRGB. Sums run in a fixed order: the same figures for any number of threads.
/// Throws Error{invalid_argument} if the sizes differ, an image has no colour, or a pixel is NaN or infinite (saying
/// which): a mean over such pixels would mean nothing.
Comparison compare(const Image& image, const Image& reference);

/// Pixels a degree of visual angle that FLIP assumes where nothing else is said: 0.7 m from a 0.7 m screen of 3840.
inline constexpr float kFlipPixelsPerDegree = 67.0f;

/// LDR-FLIP error of each pixel, 0 (no difference seen) to 1.
///
/// `test` and `reference` are width * height pixels of linear Rec. 709 in [0, 1], i.e. sRGB images after decoding.
/// Throws Error{invalid_argument} if the counts do not match the size or the pixels a degree are not in [10, 1000].
/// Source: Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images".
std::vector<float> ldr_flip(const std::vector<Vec3>& test, const std::vector<Vec3>& reference, int width, int height,
                            float pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace lightcuts
