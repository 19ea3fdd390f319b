#include "cpu/film.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace lightcuts {
namespace {

using Range = tbb::blocked_range<std::size_t>;

/// Pixels that a thread takes at least.
constexpr std::size_t kGrain = 8192;

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

bool Film::has_all_samples(std::uint32_t sample_count) const {
  return tbb::parallel_reduce(
      Range(0, pixels_.size(), kGrain), true,
      [&](const Range& range, bool so_far) {
        for (std::size_t i = range.begin(); so_far && i != range.end(); ++i)
          so_far = pixels_[i].samples == sample_count;
        return so_far;
      },
      std::logical_and<>());
}

Image Film::image(std::uint32_t sample_count) const {
  Image image = make_picture(width_, height_, with_cuts_);
  Channel* const weight = has_all_samples(sample_count) ? nullptr : &mark_incomplete(image);
  tbb::parallel_for(Range(0, pixels_.size(), kGrain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Pixel& pixel = pixels_[i];
      if (weight != nullptr) weight->values[i] = static_cast<float>(pixel.samples) / static_cast<float>(sample_count);
      if (pixel.samples > 0) set_pixel(image, i, mean_of(pixel), with_cuts_);
    }
  });
  return image;
}

PixelPlanes Film::mean_of(const Pixel& pixel) {
  const double share = 1.0 / pixel.samples;
  const auto scale = static_cast<float>(share);
  PixelPlanes planes{pixel.radiance * share, pixel.albedo * scale, pixel.normal * scale};
  if (pixel.hits > 0) planes.depth = pixel.depth / static_cast<float>(pixel.hits);
  planes.cut_size = pixel.cut_size * scale;
  planes.cut_bound = pixel.cut_bound;
  return planes;
}

}  // namespace lightcuts
