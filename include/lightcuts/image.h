#pragma once

#include <map>
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

}  // namespace lightcuts
