#include "cpu/film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace lightcuts {
namespace {

/// Single precision, kept finite: lights of absurd strength must not leave infinities (or, multiplied by a black albedo,
/// NaN) in a picture.
float finite(double v) {
  constexpr double largest = std::numeric_limits<float>::max();
  return std::isnan(v) ? 0.0f : static_cast<float>(std::clamp(v, -largest, largest));
}

}  // namespace

Film::Film(int width, int height, bool with_cuts)
    : width_(width),
      height_(height),
      with_cuts_(with_cuts),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

void Film::add(int x, int y, const Sample& sample) {
  Pixel& pixel = pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  pixel.radiance += sample.radiance;
  pixel.albedo += sample.albedo;
  pixel.normal += sample.normal;
  if (std::isfinite(sample.depth)) {
    pixel.depth += sample.depth;
    ++pixel.hits;
  }
  pixel.cut_size += sample.cut_size;
  pixel.cut_bound = std::max(pixel.cut_bound, sample.cut_bound);
  ++pixel.samples;
}

Image Film::image(std::uint32_t sample_count) const {
  Image image = make_rgb_image(width_, height_);
  constexpr std::array names{"albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z", "depth.Z"};
  for (const char* name : names) ensure_channel(image, name);
  if (with_cuts_) {
    ensure_channel(image, "cut.size");
    ensure_channel(image, "cut.bound");
  }
  const bool complete =
      std::all_of(pixels_.begin(), pixels_.end(), [&](const Pixel& p) { return p.samples == sample_count; });
  if (!complete) {
    ensure_channel(image, "weight");
    image.attributes["complete"] = "false";
  }

  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const Pixel& pixel = pixels_[i];
    const auto plane = [&](std::size_t k) -> float& { return image.channels[k].values[i]; };
    if (!complete)
      image.channels.back().values[i] = static_cast<float>(pixel.samples) / static_cast<float>(sample_count);
    if (pixel.samples == 0) continue;
    const double share = 1.0 / pixel.samples;
    const auto scale = static_cast<float>(share);
    plane(0) = finite(pixel.radiance.x * share);
    plane(1) = finite(pixel.radiance.y * share);
    plane(2) = finite(pixel.radiance.z * share);
    plane(3) = pixel.albedo.x * scale;
    plane(4) = pixel.albedo.y * scale;
    plane(5) = pixel.albedo.z * scale;
    plane(6) = pixel.normal.x * scale;
    plane(7) = pixel.normal.y * scale;
    plane(8) = pixel.normal.z * scale;
    plane(9) = pixel.hits == 0 ? std::numeric_limits<float>::infinity() : pixel.depth / static_cast<float>(pixel.hits);
    if (with_cuts_) {
      plane(10) = pixel.cut_size * scale;
      plane(11) = pixel.cut_bound;
    }
  }
  return image;
}

}  // namespace lightcuts
