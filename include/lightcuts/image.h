#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lightcuts/math.h"

namespace lightcuts {

/// One plane of an image; names follow OpenEXR: "R", "albedo.G", "depth.Z", "cut.size".
struct Channel {
  std::string name;
  std::vector<float> values;  ///< row by row from the top left, width * height
};

/// A picture of named float planes of one size. Colour is linear Rec. 709 radiance [W/(m^2 sr)].
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Channel> channels;
  std::map<std::string, std::string> attributes;  ///< text stored with the picture, e.g. "complete" -> "false"

  [[nodiscard]] std::size_t pixel_count() const { return static_cast<std::size_t>(width) * height; }
};

/// The plane of that name, or nullptr.
const Channel* find_channel(const Image& image, std::string_view name);
Channel* find_channel(Image& image, std::string_view name);

/// The plane of that name, added and filled with zeros where it is missing. References to other planes stay valid only
/// until the next call.
Channel& ensure_channel(Image& image, std::string_view name);

/// An image with the planes R, G and B, all zero. Throws Error{invalid_argument} for a size below 1.
Image make_rgb_image(int width, int height);

/// Colour of pixel `index` (y * width + x): R, G and B, or a single plane (Y, or the only one) three times.
/// Throws Error{invalid_argument} if the image has neither.
std::vector<Vec3> rgb_pixels(const Image& image);

/// 8-bit RGB picture, row by row from the top left, as it goes to a screen (sRGB-encoded).
struct DisplayImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Exposure [EV] that shows an image's middle tones as middle grey; the image is multiplied by 2^EV before it is
/// encoded.
///
/// EV = log2(0.18 / key), where key is the geometric mean of the luminance of all lit pixels (finite and above zero)
/// but the darkest and the brightest twentieth of them, so that neither a visible lamp nor a dark corner decides. An
/// image without a lit pixel gives 0. Throws Error{invalid_argument} if the image has no colour (see rgb_pixels).
float auto_exposure(const Image& image);

/// The picture for a screen: exposure, tone curve, sRGB encoding (IEC 61966-2-1), rounded to the nearest of 256 steps.
///
/// The curve is applied to each channel x = 2^exposure_ev * value and changes nothing below 0.6; above, it bends
/// towards 1 with a continuous slope: 0.6 + 0.4 t / (1 + t) with t = (x - 0.6) / 0.4. Negative values and NaN become 0,
/// infinity becomes 1. Throws Error{invalid_argument} as rgb_pixels does.
DisplayImage tone_map(const Image& image, float exposure_ev);

/// One plane in colours, and what they stand for.
struct FalseColour {
  DisplayImage picture;
  float low = 0;               ///< value of the first colour, dark violet
  float high = 0;              ///< value of the last colour, yellow
  std::size_t not_finite = 0;  ///< pixels that are NaN or infinite; they are drawn grey
};

/// Draws one plane with a map of even perceptual steps (dark violet, blue, green, yellow), linear from its smallest to
/// its largest finite value. Throws Error{invalid_argument} that lists the planes if there is none of that name.
FalseColour false_colour(const Image& image, std::string_view channel_name);

/// The same from `low` to `high`; values outside get the colours at the ends.
FalseColour false_colour(int width, int height, std::span<const float> values, float low, float high);

}  // namespace lightcuts
