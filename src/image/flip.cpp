#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "image/parallel.h"
#include "lightcuts/compare.h"
#include "lightcuts/error.h"

// LDR-FLIP, Andersson et al. 2020. Section numbers below are the paper's. Every two-dimensional filter of the paper is
// a sum of products of one-dimensional ones, and is applied as such.

namespace lightcuts {
namespace {

using Kernel = std::vector<float>;  ///< 2 * radius + 1 weights

struct Plane {
  int width = 0, height = 0;
  std::vector<float> values;

  Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * h) {}
  [[nodiscard]] const float* row(int y) const { return values.data() + static_cast<std::size_t>(y) * width; }
  [[nodiscard]] float* row(int y) { return values.data() + static_cast<std::size_t>(y) * width; }
};

// ---- colour spaces ----

/// XYZ of linear sRGB under D65, to the digits that the paper's own tables use.
constexpr std::array<std::array<double, 3>, 3> kXyzFromRgb{
    {{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
     {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
     {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}}};
/// Inverse of kXyzFromRgb by cofactors.
constexpr std::array<std::array<double, 3>, 3> inverse(const std::array<std::array<double, 3>, 3>& m) {
  std::array<std::array<double, 3>, 3> out{};
  double determinant = 0;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      out[c][r] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    }
  }
  for (int c = 0; c < 3; ++c) determinant += m[0][c] * out[c][0];
  for (auto& row : out) {
    for (double& value : row) value /= determinant;
  }
  return out;
}
constexpr auto kRgbFromXyz = inverse(kXyzFromRgb);

Vec3 multiply(const std::array<std::array<double, 3>, 3>& m, Vec3 v) {
  const auto row = [&](int r) {
    return static_cast<float>(m[r][0]) * v.x + static_cast<float>(m[r][1]) * v.y + static_cast<float>(m[r][2]) * v.z;
  };
  return {row(0), row(1), row(2)};
}

/// XYZ relative to the white of the display.
Vec3 relative_xyz(Vec3 rgb) {
  static const Vec3 white = multiply(kXyzFromRgb, {1, 1, 1});
  const Vec3 xyz = multiply(kXyzFromRgb, rgb);
  return {xyz.x / white.x, xyz.y / white.y, xyz.z / white.z};
}

/// Linearised CIELAB (achromatic, red-green, blue-yellow): section 4.1.1.
Vec3 ycxcz_from_rgb(Vec3 rgb) {
  const Vec3 n = relative_xyz(rgb);
  return {116 * n.y - 16, 500 * (n.x - n.y), 200 * (n.y - n.z)};
}

Vec3 rgb_from_ycxcz(Vec3 v) {
  static const Vec3 white = multiply(kXyzFromRgb, {1, 1, 1});
  const float y = (v.x + 16) / 116;
  const float x = y + v.y / 500;
  const float z = y - v.z / 200;
  return multiply(kRgbFromXyz, {x * white.x, y * white.y, z * white.z});
}

float lab_curve(float t) {
  constexpr float delta = 6.0f / 29;
  return t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4.0f / 29;
}

/// CIELAB with chroma scaled by lightness (Hunt effect): section 4.1.2.
Vec3 hunt_lab_from_rgb(Vec3 rgb) {
  const Vec3 n = relative_xyz(rgb);
  const float fx = lab_curve(n.x), fy = lab_curve(n.y), fz = lab_curve(n.z);
  const float lightness = 116 * fy - 16;
  return {lightness, 0.01f * lightness * 500 * (fx - fy), 0.01f * lightness * 200 * (fy - fz)};
}

/// City-block distance in lightness, Euclidean in chroma.
float hyab(Vec3 a, Vec3 b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

// ---- filters ----

/// Weights fn(x) for x = -radius .. radius.
template <class Fn>
Kernel make_kernel(int radius, const Fn& fn) {
  Kernel kernel;
  for (int x = -radius; x <= radius; ++x) kernel.push_back(static_cast<float>(fn(double(x))));
  return kernel;
}

double sum(const Kernel& kernel) { return std::accumulate(kernel.begin(), kernel.end(), 0.0); }

void scale(Kernel& kernel, double factor) {
  for (float& w : kernel) w = static_cast<float>(w * factor);
}

/// Positive weights scaled to sum to 1 and negative ones to -1.
void balance(Kernel& kernel) {
  double positive = 0, negative = 0;
  for (const float w : kernel) (w > 0 ? positive : negative) += double{w};
  for (float& w : kernel) w = static_cast<float>(double{w} / (w > 0 ? positive : -negative));
}

/// One row filtered along x. `padded` is room for width + 2 * radius values; borders repeat the last pixel.
void filter_row(const float* in, float* out, int width, const Kernel& kernel, std::vector<float>& padded) {
  const int radius = static_cast<int>(kernel.size() / 2);
  padded.resize(static_cast<std::size_t>(width + 2 * radius));
  std::fill_n(padded.begin(), radius, in[0]);
  std::copy_n(in, width, padded.begin() + radius);
  std::fill_n(padded.begin() + radius + width, radius, in[width - 1]);
  std::fill_n(out, width, 0.0f);
  for (std::size_t k = 0; k < kernel.size(); ++k) {
    const float w = kernel[k];
    const float* source = padded.data() + k;
    for (int x = 0; x < width; ++x) out[x] += w * source[x];
  }
}

Plane filter_x(const Plane& in, const Kernel& kernel) {
  Plane out(in.width, in.height);
  for_each_row(in.height, [&](int y) {
    thread_local std::vector<float> padded;
    filter_row(in.row(y), out.row(y), in.width, kernel, padded);
  });
  return out;
}

Plane filter_y(const Plane& in, const Kernel& kernel) {
  const int radius = static_cast<int>(kernel.size() / 2);
  Plane out(in.width, in.height);
  for_each_row(in.height, [&](int y) {
    float* target = out.row(y);
    for (int k = -radius; k <= radius; ++k) {
      const float w = kernel[static_cast<std::size_t>(k + radius)];
      const float* source = in.row(clamp_to(y + k, 0, in.height - 1));
      for (int x = 0; x < in.width; ++x) target[x] += w * source[x];
    }
  });
  return out;
}

Plane filter_xy(const Plane& in, const Kernel& along_x, const Kernel& along_y) {
  return filter_y(filter_x(in, along_x), along_y);
}

// ---- the eye's contrast sensitivity (section 4.1.1) ----

/// One term a sqrt(pi / b) exp(-pi^2 x^2 / b) of a contrast sensitivity function, x in degrees.
struct Gaussian {
  double a, b;
};
constexpr double kPiDouble = 3.14159265358979323846;
constexpr Gaussian kAchromatic{1, 0.0047};
constexpr Gaussian kRedGreen{1, 0.0053};
constexpr std::array<Gaussian, 2> kBlueYellow{{{34.1, 0.04}, {13.5, 0.025}}};

struct Sensitivity {
  int radius;
  double pixels_per_degree;

  explicit Sensitivity(double ppd)
      : radius(static_cast<int>(std::ceil(3 * std::sqrt(kBlueYellow[0].b / (2 * kPiDouble * kPiDouble)) * ppd))),
        pixels_per_degree(ppd) {}

  [[nodiscard]] Kernel kernel(Gaussian g) const {
    return make_kernel(radius, [&](double x) {
      const double degrees = x / pixels_per_degree;
      return std::exp(-kPiDouble * kPiDouble * degrees * degrees / g.b);
    });
  }

  [[nodiscard]] Plane filter(const Plane& in, Gaussian g) const {
    Kernel k = kernel(g);
    scale(k, 1 / sum(k));
    return filter_xy(in, k, k);
  }

  /// Two terms: their weights are those of the paper's kernel in two dimensions, which sums to 1 as a whole.
  [[nodiscard]] Plane filter(const Plane& in, const std::array<Gaussian, 2>& terms) const {
    std::array<double, 2> weights{};
    for (std::size_t i = 0; i < 2; ++i) {
      const double s = sum(kernel(terms[i]));
      weights[i] = terms[i].a * std::sqrt(kPiDouble / terms[i].b) * s * s;
    }
    Plane out = filter(in, terms[0]);
    const Plane second = filter(in, terms[1]);
    const auto share = static_cast<float>(weights[0] / (weights[0] + weights[1]));
    for (std::size_t i = 0; i < out.values.size(); ++i) {
      out.values[i] = share * out.values[i] + (1 - share) * second.values[i];
    }
    return out;
  }
};

/// Planes of an image in YCxCz.
std::array<Plane, 3> ycxcz_planes(const std::vector<Vec3>& rgb, int width, int height) {
  std::array<Plane, 3> planes{Plane(width, height), Plane(width, height), Plane(width, height)};
  for_each_row(height, [&](int y) {
    const auto begin = static_cast<std::size_t>(y) * width;
    for (std::size_t i = begin; i < begin + width; ++i) {
      const Vec3 v = ycxcz_from_rgb(rgb[i]);
      planes[0].values[i] = v.x;
      planes[1].values[i] = v.y;
      planes[2].values[i] = v.z;
    }
  });
  return planes;
}

/// What the eye resolves of an image, in Hunt-adjusted CIELAB.
std::vector<Vec3> perceived(const std::array<Plane, 3>& ycxcz, const Sensitivity& eye) {
  const Plane y = eye.filter(ycxcz[0], kAchromatic);
  const Plane cx = eye.filter(ycxcz[1], kRedGreen);
  const Plane cz = eye.filter(ycxcz[2], kBlueYellow);
  std::vector<Vec3> lab(y.values.size());
  for_each_row(y.height, [&](int row) {
    const auto begin = static_cast<std::size_t>(row) * y.width;
    for (std::size_t i = begin; i < begin + y.width; ++i) {
      const Vec3 rgb = rgb_from_ycxcz({y.values[i], cx.values[i], cz.values[i]});
      lab[i] =
          hunt_lab_from_rgb({clamp_to(rgb.x, 0.0f, 1.0f), clamp_to(rgb.y, 0.0f, 1.0f), clamp_to(rgb.z, 0.0f, 1.0f)});
    }
  });
  return lab;
}

/// Colour error in [0, 1]: the largest possible difference maps to 1, small ones get most of the range (section 4.1.3).
float colour_error(Vec3 test, Vec3 reference) {
  constexpr float exponent = 0.7f, knee = 0.4f, knee_value = 0.95f;
  static const float largest = std::pow(hyab(hunt_lab_from_rgb({0, 1, 0}), hunt_lab_from_rgb({0, 0, 1})), exponent);
  const float error = std::pow(hyab(test, reference), exponent);
  const float at_knee = knee * largest;
  if (error < at_knee) return error * knee_value / at_knee;
  return knee_value + (error - at_knee) / (largest - at_knee) * (1 - knee_value);
}

// ---- edges and points (section 4.2) ----

/// Strengths of edges and points in an image's achromatic channel.
struct Features {
  std::vector<float> edges, points;
};

std::vector<float> magnitude(const Plane& x, const Plane& y) {
  std::vector<float> out(x.values.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = std::hypot(x.values[i], y.values[i]);
  return out;
}

Features find_features(const Plane& achromatic, double pixels_per_degree) {
  constexpr double width_degrees = 0.082;
  const double deviation = 0.5 * width_degrees * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * deviation));
  const auto gauss = [&](double x) { return std::exp(-x * x / (2 * deviation * deviation)); };
  Kernel smooth = make_kernel(radius, gauss);
  scale(smooth, 1 / sum(smooth));
  Kernel edge = make_kernel(radius, [&](double x) { return -x * gauss(x); });
  balance(edge);
  Kernel point = make_kernel(radius, [&](double x) { return (x * x / (deviation * deviation) - 1) * gauss(x); });
  balance(point);

  Plane grey(achromatic.width, achromatic.height);
  for (std::size_t i = 0; i < grey.values.size(); ++i) grey.values[i] = (achromatic.values[i] + 16) / 116;
  const Plane smooth_x = filter_x(grey, smooth);
  return {magnitude(filter_xy(grey, edge, smooth), filter_y(smooth_x, edge)),
          magnitude(filter_xy(grey, point, smooth), filter_y(smooth_x, point))};
}

/// Difference of features in [0, 1], section 4.2.2.
float feature_error(const Features& test, const Features& reference, std::size_t i) {
  const float difference =
      std::max(std::abs(test.edges[i] - reference.edges[i]), std::abs(test.points[i] - reference.points[i]));
  return std::sqrt(difference * std::sqrt(0.5f));
}

}  // namespace

std::vector<float> ldr_flip(const std::vector<Vec3>& test, const std::vector<Vec3>& reference, int width, int height,
                            float pixels_per_degree) {
  if (width < 1 || height < 1 || test.size() != static_cast<std::size_t>(width) * height ||
      reference.size() != test.size()) {
    throw Error(Code::invalid_argument, "FLIP needs two images of the size that is passed with them");
  }
  if (!(pixels_per_degree >= 10 && pixels_per_degree <= 1000)) {
    throw Error(Code::invalid_argument, "FLIP needs from 10 to 1000 pixels a degree");
  }
  const Sensitivity eye(pixels_per_degree);
  const auto test_planes = ycxcz_planes(test, width, height);
  const auto reference_planes = ycxcz_planes(reference, width, height);
  const Features test_features = find_features(test_planes[0], pixels_per_degree);
  const Features reference_features = find_features(reference_planes[0], pixels_per_degree);
  const std::vector<Vec3> test_lab = perceived(test_planes, eye);
  const std::vector<Vec3> reference_lab = perceived(reference_planes, eye);

  // Features that differ amplify a difference in colour: section 4.3.
  std::vector<float> error(test.size());
  for_each_row(height, [&](int y) {
    const auto begin = static_cast<std::size_t>(y) * width;
    for (std::size_t i = begin; i < begin + width; ++i) {
      const float colour = colour_error(test_lab[i], reference_lab[i]);
      error[i] = std::pow(colour, 1 - feature_error(test_features, reference_features, i));
    }
  });
  return error;
}

}  // namespace lightcuts
