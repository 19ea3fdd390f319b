#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "image/parallel.h"
#include "lightcuts/error.h"
#include "lightcuts/image.h"

namespace lightcuts {
namespace {

constexpr float kMiddleGrey = 0.18f;
constexpr double kTrimmedShare = 0.05;  ///< of the lit pixels, at either end
constexpr float kShoulder = 0.6f;       ///< where the tone curve leaves the identity

/// Darkest and brightest few removed, the geometric mean of what is left; 0 if there is nothing.
double trimmed_geometric_mean(std::vector<float> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto cut = static_cast<std::size_t>(kTrimmedShare * static_cast<double>(values.size()));
  double log_sum = 0;
  for (std::size_t i = cut; i < values.size() - cut; ++i) log_sum += std::log(static_cast<double>(values[i]));
  return std::exp(log_sum / static_cast<double>(values.size() - 2 * cut));
}

float tone_curve(float x) {
  if (!(x > 0)) return 0;
  if (x <= kShoulder) return x;
  if (std::isinf(x)) return 1;
  const float t = (x - kShoulder) / (1 - kShoulder);
  return kShoulder + (1 - kShoulder) * (t / (1 + t));
}

/// sRGB transfer function of IEC 61966-2-1 for x in [0, 1].
float encode_srgb(float x) { return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f; }

std::uint8_t to_byte(float unit) { return static_cast<std::uint8_t>(std::lround(255.0f * clamp_to(unit, 0.0f, 1.0f))); }

/// The colours known as viridis, at ten even steps of its parameter, sRGB.
constexpr std::array<std::array<float, 3>, 10> kColours{{{68, 1, 84},
                                                         {72, 40, 120},
                                                         {62, 73, 137},
                                                         {49, 104, 142},
                                                         {38, 130, 142},
                                                         {31, 158, 137},
                                                         {53, 183, 121},
                                                         {110, 206, 88},
                                                         {181, 222, 43},
                                                         {253, 231, 37}}};
constexpr std::array<std::uint8_t, 3> kNotFiniteColour{128, 128, 128};

std::array<std::uint8_t, 3> colour_at(float unit) {
  const float place = clamp_to(unit, 0.0f, 1.0f) * (kColours.size() - 1);
  const auto first = std::min(static_cast<std::size_t>(place), kColours.size() - 2);
  const float share = place - static_cast<float>(first);
  std::array<std::uint8_t, 3> rgb{};
  for (std::size_t c = 0; c < 3; ++c) {
    rgb[c] = to_byte((kColours[first][c] * (1 - share) + kColours[first + 1][c] * share) / 255);
  }
  return rgb;
}

DisplayImage make_display_image(int width, int height) {
  return {width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height * 3)};
}

}  // namespace

float auto_exposure(const Image& image) {
  std::vector<float> lit;
  for (const Vec3& pixel : rgb_pixels(image)) {
    const float l = luminance(pixel);
    if (std::isfinite(l) && l > 0) lit.push_back(l);
  }
  const double key = trimmed_geometric_mean(std::move(lit));
  return key > 0 ? static_cast<float>(std::log2(kMiddleGrey / key)) : 0.0f;
}

DisplayImage tone_map(const Image& image, float exposure_ev) {
  const std::vector<Vec3> pixels = rgb_pixels(image);
  const float gain = std::exp2(exposure_ev);
  DisplayImage out = make_display_image(image.width, image.height);
  for_each_row(image.height, [&](int y) {
    const auto begin = static_cast<std::size_t>(y) * image.width;
    for (std::size_t i = begin; i < begin + image.width; ++i) {
      for (int c = 0; c < 3; ++c) {
        out.rgb[3 * i + c] = to_byte(encode_srgb(tone_curve(gain * component(pixels[i], c))));
      }
    }
  });
  return out;
}

FalseColour false_colour(const Image& image, std::string_view channel_name) {
  const Channel* channel = find_channel(image, channel_name);
  if (channel == nullptr) {
    std::string names;
    for (const Channel& c : image.channels) names += (names.empty() ? "" : ", ") + c.name;
    throw Error(Code::invalid_argument,
                fmt::format("the image has no layer '{}'; it has: {}", channel_name, names.empty() ? "none" : names));
  }
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  for (const float v : channel->values) {
    if (!std::isfinite(v)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (low > high) low = high = 0;
  return false_colour(image.width, image.height, channel->values, low, high);
}

FalseColour false_colour(int width, int height, std::span<const float> values, float low, float high) {
  FalseColour out{make_display_image(width, height), low, high, 0};
  if (values.size() * 3 != out.picture.rgb.size()) {
    throw Error(Code::invalid_argument, "a false-colour picture needs one value a pixel");
  }
  const float scale = high > low ? 1 / (high - low) : 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool finite = std::isfinite(values[i]);
    out.not_finite += finite ? 0 : 1;
    const auto rgb = finite ? colour_at((values[i] - low) * scale) : kNotFiniteColour;
    std::copy(rgb.begin(), rgb.end(), out.picture.rgb.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  return out;
}

}  // namespace lightcuts
