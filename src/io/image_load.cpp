#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string_view>

#include "io/image_ending.h"
#include "io/image_formats.h"
#include "io/read_file.h"
#include "io/texture_decode.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

/// Radiance of each 8-bit code. Source: IEC 61966-2-1 (sRGB).
std::array<float, 256> linear_of_srgb() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double v = static_cast<double>(i) / 255;
    table[i] = static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return table;
}

/// Planes R, G and B (grey three times), and A where the texture has it, which is linear already.
Image linear_image(const TextureImage& texture) {
  const std::array<float, 256> linear = linear_of_srgb();
  Image image = make_rgb_image(texture.width, texture.height);
  const auto channels = static_cast<std::size_t>(texture.channels);
  const bool grey = channels < 3;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t source = grey ? 0 : c;
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
      image.channels[c].values[i] = linear[texture.texels[i * channels + source]];
    }
  }
  if (channels % 2 == 0) {
    std::vector<float>& alpha = ensure_channel(image, "A").values;
    for (std::size_t i = 0; i < alpha.size(); ++i) {
      alpha[i] = static_cast<float>(texture.texels[i * channels + channels - 1]) / 255;
    }
  }
  return image;
}

Image read_texture(std::span<const std::byte> bytes, const std::string& name) {
  const TextureHeader header = read_texture_header(bytes, name);
  if (sizeof(float) * 4.0 * header.width * header.height > static_cast<double>(kImageBudget)) {
    throw Error(Code::unsupported, "'" + name + "' has " + std::to_string(header.width) + " x " +
                                       std::to_string(header.height) +
                                       " pixels, more than fit the limit of 1024 MiB for a picture; make it smaller");
  }
  return linear_image(decode_texture(bytes, name));
}

bool starts_with(std::span<const std::byte> bytes, std::string_view start) {
  return bytes.size() >= start.size() && std::memcmp(bytes.data(), start.data(), start.size()) == 0;
}

}  // namespace

Image load_image(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::vector<std::byte> bytes = read_file(path, kImageBudget);

  // By content; the ending only serves the message.
  if (starts_with(bytes, "\x76\x2f\x31\x01")) return read_exr(bytes, name);
  if (starts_with(bytes, "#?")) return read_hdr(bytes, name);
  if (starts_with(bytes, "\x89PNG") || starts_with(bytes, "\xff\xd8")) return read_texture(bytes, name);

  const std::string ending = lower_case_ending(path);
  for (const char* known : {".exr", ".hdr", ".png", ".jpg", ".jpeg"}) {
    if (ending == known)
      throw Error(Code::malformed, "'" + name + "' does not hold what its ending " + ending + " promises");
  }
  throw Error(Code::unsupported, "'" + name + "' is no picture of a known format: OpenEXR, Radiance HDR, PNG or JPEG");
}

}  // namespace lightcuts
