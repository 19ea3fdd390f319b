#include "lightcuts/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "image/parallel.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

constexpr double kDarkShare = 0.01;    ///< of m: pixels darker than that have no relative error
constexpr double kRelmseFloor = 0.01;  ///< of m^2: keeps dark pixels of B from dominating relmse
constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::vector<Vec3> finite_pixels(const Image& image, const char* which) {
  std::vector<Vec3> pixels = rgb_pixels(image);
  const auto bad = [](const Vec3& p) { return !is_finite(p); };
  const auto first = std::find_if(pixels.begin(), pixels.end(), bad);
  if (first == pixels.end()) return pixels;
  const auto index = first - pixels.begin();
  throw Error(Code::invalid_argument,
              fmt::format("{} has {} pixels that are NaN or infinite, the first at column {}, row {}; images can only "
                          "be compared where every pixel is a number: render it again, or replace those pixels",
                          which, std::count_if(first, pixels.end(), bad), index % image.width, index / image.width));
}

double squared(double x) { return x * x; }

/// Sum over all pixels and channels of fn(a, b).
template <class Fn>
double sum_channels(const std::vector<Vec3>& a, const std::vector<Vec3>& b, int width, int height, const Fn& fn) {
  return sum_of_rows(height, [&](int y) {
    double sum = 0;
    const auto begin = static_cast<std::size_t>(y) * width;
    for (std::size_t i = begin; i < begin + width; ++i) {
      for (int c = 0; c < 3; ++c) sum += fn(double{component(a[i], c)}, double{component(b[i], c)});
    }
    return sum;
  });
}

double mean_luminance(const std::vector<Vec3>& pixels, int width, int height) {
  const double sum = sum_of_rows(height, [&](int y) {
    double row = 0;
    const auto begin = static_cast<std::size_t>(y) * width;
    for (std::size_t i = begin; i < begin + width; ++i) row += double{luminance(pixels[i])};
    return row;
  });
  return sum / static_cast<double>(pixels.size());
}

/// Signed relative errors of luminance of the pixels that are not too dark.
std::vector<double> relative_errors(const std::vector<Vec3>& a, const std::vector<Vec3>& b, double darkest) {
  std::vector<double> errors;
  errors.reserve(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double lb = luminance(b[i]);
    if (lb >= darkest) errors.push_back((luminance(a[i]) - lb) / lb);
  }
  return errors;
}

/// Mean relative errors of the three channels of the same pixels. A channel may be black where the pixel is not, so its
/// value is taken for `darkest` at least.
void fill_channel_errors(Comparison& out, const std::vector<Vec3>& a, const std::vector<Vec3>& b, double darkest) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    if (double{luminance(b[i])} < darkest) continue;
    ++count;
    for (int c = 0; c < 3; ++c) {
      const double from = component(b[i], c);
      out.channel_relative_error[c] += std::abs(component(a[i], c) - from) / std::max(from, darkest);
    }
  }
  for (double& error : out.channel_relative_error) error /= static_cast<double>(std::max<std::size_t>(1, count));
}

/// Value below which a share of the values lies, linear between the two nearest ranks. Reorders the values.
double percentile(std::vector<double>& values, double share) {
  const double rank = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), values.begin() + below, values.end());
  const double low = values[static_cast<std::size_t>(below)];
  if (static_cast<std::size_t>(below) + 1 == values.size()) return low;
  const double high = *std::min_element(values.begin() + below + 1, values.end());
  return low + (high - low) * (rank - static_cast<double>(below));
}

void fill_relative_errors(Comparison& out, std::vector<double> errors) {
  const auto count = static_cast<double>(errors.size());
  for (double& e : errors) {
    out.signed_relative_error += e / count;
    e = std::abs(e);
    out.mean_relative_error += e / count;
  }
  out.p99_relative_error = percentile(errors, 0.99);
}

/// What a screen without a tone curve shows: exposed and clamped, still linear.
std::vector<Vec3> exposed(std::vector<Vec3> pixels, float exposure_ev) {
  const float gain = std::exp2(exposure_ev);
  for (Vec3& p : pixels) {
    for (float* value : {&p.x, &p.y, &p.z}) *value = clamp_to(*value * gain, 0.0f, 1.0f);
  }
  return pixels;
}

}  // namespace

Comparison compare(const Image& image, const Image& reference) {
  if (image.width != reference.width || image.height != reference.height) {
    throw Error(
        Code::invalid_argument,
        fmt::format("the images differ in size: {}x{} pixels against the reference's {}x{}; render the first "
                    "with --size {}x{}",
                    image.width, image.height, reference.width, reference.height, reference.width, reference.height));
  }
  const std::vector<Vec3> a = finite_pixels(image, "the image");
  const std::vector<Vec3> b = finite_pixels(reference, "the reference");
  const int width = reference.width;
  const int height = reference.height;
  const double values = 3.0 * static_cast<double>(b.size());
  Comparison out;

  // Squared errors.
  const double squares = sum_channels(a, b, width, height, [](double x, double y) { return squared(x - y); });
  out.rmse = std::sqrt(squares / values);
  const double m = mean_luminance(b, width, height);
  if (m > 0) {
    const double floor = kRelmseFloor * squared(m);
    out.relmse =
        sum_channels(a, b, width, height, [&](double x, double y) { return squared(x - y) / (squared(y) + floor); }) /
        values;
    std::vector<double> errors = relative_errors(a, b, kDarkShare * m);
    out.dark_pixels = b.size() - errors.size();
    fill_relative_errors(out, std::move(errors));
    fill_channel_errors(out, a, b, kDarkShare * m);
  } else {
    out.dark_pixels = b.size();
    const double error = squares > 0 ? kInfinite : 0;
    out.relmse = out.mean_relative_error = out.p99_relative_error = out.signed_relative_error = error;
    std::fill_n(out.channel_relative_error, 3, error);
  }

  // What a person would see when flipping between the two.
  out.exposure_ev = auto_exposure(reference);
  out.flip_map = ldr_flip(exposed(a, out.exposure_ev), exposed(b, out.exposure_ev), width, height);
  out.flip = sum_of_rows(height,
                         [&](int y) {
                           const auto row = out.flip_map.begin() + static_cast<std::ptrdiff_t>(y) * width;
                           return std::accumulate(row, row + width, 0.0);
                         }) /
             static_cast<double>(b.size());
  return out;
}

}  // namespace lightcuts
