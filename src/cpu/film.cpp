#include "cpu/film.h"

#include <algorithm>
#include <cmath>

#include "backend/picture_planes.h"

namespace lightcuts {
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
  Image image = make_picture(width_, height_, with_cuts_);
  const bool complete =
      std::all_of(pixels_.begin(), pixels_.end(), [&](const Pixel& p) { return p.samples == sample_count; });
  Channel* const weight = complete ? nullptr : &mark_incomplete(image);
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const Pixel& pixel = pixels_[i];
    if (weight != nullptr) weight->values[i] = static_cast<float>(pixel.samples) / static_cast<float>(sample_count);
    if (pixel.samples == 0) continue;
    const double share = 1.0 / pixel.samples;
    const auto scale = static_cast<float>(share);
    PixelPlanes planes{pixel.radiance * share, pixel.albedo * scale, pixel.normal * scale};
    if (pixel.hits > 0) planes.depth = pixel.depth / static_cast<float>(pixel.hits);
    planes.cut_size = pixel.cut_size * scale;
    planes.cut_bound = pixel.cut_bound;
    set_pixel(image, i, planes, with_cuts_);
  }
  return image;
}

}  // namespace lightcuts
