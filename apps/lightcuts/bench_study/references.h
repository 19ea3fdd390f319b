#pragma once

#include "lightcuts/image.h"
#include "lightcuts/render.h"

namespace lightcuts::app::study {

/// Two independent halves of a reference picture.
struct Halves {
  Image first, second;
};

/// Path-traced on the CPU through the pixels' centres, where methods with one sample a pixel look: edges of what is seen
/// must not count as their error. `samples` paths a pixel in each half.
Halves trace_centres(const Scene& scene, const Camera& camera, int side, std::uint32_t samples,
                     const ProgressFn& progress);

/// A mean over pixels and how far it may be off by chance.
struct Estimate {
  double value = 0, standard_error = 0;
};

/// relMSE against the truth that both halves are noisy measurements of: the product of the differences from two
/// independent halves has the square of the difference from the truth as its mean. What it is divided by is taken from the
/// pixels around, whose noise is another: a pixel's own would favour those that came out dark. Can be slightly negative.
Estimate relmse_without_noise(const Image& image, const Halves& reference);

}  // namespace lightcuts::app::study
