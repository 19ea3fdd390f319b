#include <algorithm>
#include <array>
#include <cmath>

#include "io/image_formats.h"

namespace lightcuts {
namespace {

using Rgbe = std::array<std::uint8_t, 4>;

// Largest value of the format: mantissa 255/256 at exponent 127.
constexpr float kLargest = 255 * 0x1p119f;

/// What the format cannot hold becomes its nearest neighbour: negative and NaN become 0, infinity the largest value.
float representable(float v) { return v > 0 ? std::min(v, kLargest) : 0.0f; }

/// Source: Ward, "Real Pixels", Graphics Gems II, 1991; rounds to nearest, so that nothing gets darker on the mean.
Rgbe encode_rgbe(Vec3 rgb) {
  const Vec3 c{representable(rgb.x), representable(rgb.y), representable(rgb.z)};
  int exponent = 0;
  const float largest = max_component(c);
  std::frexp(largest, &exponent);
  if (std::nearbyint(std::ldexp(largest, 8 - exponent)) > 255) ++exponent;  // rounding up reached the next power of two
  if (largest == 0 || exponent < -127) return {0, 0, 0, 0};
  const auto mantissa = [&](float v) { return static_cast<std::uint8_t>(std::nearbyint(std::ldexp(v, 8 - exponent))); };
  return {mantissa(c.x), mantissa(c.y), mantissa(c.z), static_cast<std::uint8_t>(exponent + 128)};
}

/// One component of a scan line: runs of at least 4 equal bytes as (128 + count, byte), the rest as (count, bytes...).
void append_runs(std::string& file, const std::vector<std::uint8_t>& line) {
  constexpr std::size_t kMinRun = 4, kMaxRun = 127, kMaxLiteral = 128;
  const auto run_length = [&](std::size_t begin) {
    std::size_t end = begin + 1;
    while (end < line.size() && end - begin < kMaxRun && line[end] == line[begin]) ++end;
    return end - begin;
  };
  std::size_t literal = 0;  // first byte not written yet
  const auto flush = [&](std::size_t end) {
    while (literal < end) {
      const std::size_t count = std::min(end - literal, kMaxLiteral);
      file.push_back(static_cast<char>(count));
      file.append(line.begin() + literal, line.begin() + literal + count);
      literal += count;
    }
  };
  for (std::size_t i = 0; i < line.size();) {
    const std::size_t run = run_length(i);
    if (run >= kMinRun) {
      flush(i);
      file.push_back(static_cast<char>(128 + run));
      file.push_back(static_cast<char>(line[i]));
      literal = i + run;
    }
    i += run;
  }
  flush(line.size());
}

}  // namespace

std::string encode_hdr(const Image& image) {
  const std::vector<Vec3> pixels = rgb_pixels(image);
  std::string file = "#?RADIANCE\nSOFTWARE=lightcuts\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(image.height) +
                     " +X " + std::to_string(image.width) + "\n";
  // Run lengths exist for these widths only; others are written flat.
  const bool runs = image.width >= 8 && image.width <= 0x7fff;
  std::array<std::vector<std::uint8_t>, 4> components;
  for (int y = 0; y < image.height; ++y) {
    for (auto& component : components) component.clear();
    for (int x = 0; x < image.width; ++x) {
      const Rgbe texel = encode_rgbe(pixels[static_cast<std::size_t>(y) * image.width + x]);
      if (!runs) file.append(texel.begin(), texel.end());
      for (std::size_t c = 0; c < 4; ++c) components[c].push_back(texel[c]);
    }
    if (!runs) continue;
    for (const int byte : {2, 2, image.width >> 8, image.width & 255}) file.push_back(static_cast<char>(byte));
    for (const auto& component : components) append_runs(file, component);
  }
  return file;
}

}  // namespace lightcuts
