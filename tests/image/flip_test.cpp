#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <string>

#include "lightcuts/compare.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

using Pattern = std::function<int(int x, int y, int c)>;

/// sRGB bytes by integer formulas; the same stand in flip_expected.py.
const std::map<std::string, Pattern>& patterns() {
  static const std::map<std::string, Pattern> all{
      {"ramp", [](int x, int y, int c) { return (3 * x + 2 * y + 40 * c) % 256; }},
      {"brighter ramp", [](int x, int y, int c) { return std::min(255, (3 * x + 2 * y + 40 * c) % 256 + 12); }},
      {"checker", [](int x, int y, int) { return (x / 8 + y / 8) % 2 != 0 ? 230 : 25; }},
      {"shifted checker", [](int x, int y, int) { return ((x + 1) / 8 + y / 8) % 2 != 0 ? 230 : 25; }},
      {"noise", [](int x, int y, int c) { return (x * 7919 + y * 104729 + c * 1299709 + x * y * 31) % 251; }},
      {"lines", [](int x, int y, int c) { return (x + 2 * y) % 11 == c ? 255 : 60; }},
      {"green", [](int, int, int c) { return c == 1 ? 255 : 0; }},
      {"blue", [](int, int, int c) { return c == 2 ? 255 : 0; }},
      {"stains",
       [](int x, int y, int c) { return (x - 30) * (x - 30) + (y - 20) * (y - 20) < 150 * (c + 1) ? 255 : 128; }}};
  return all;
}

float decode_srgb(double s) {
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

std::vector<Vec3> picture(const std::string& name, int width, int height) {
  const Pattern& byte = patterns().at(name);
  std::vector<Vec3> pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      pixels.push_back(
          {decode_srgb(byte(x, y, 0) / 255.0), decode_srgb(byte(x, y, 1) / 255.0), decode_srgb(byte(x, y, 2) / 255.0)});
    }
  }
  return pixels;
}

struct Expected {
  const char* test;
  const char* reference;
  int width, height;
  float pixels_per_degree;
  double mean;
  float one_pixel;  ///< at (width / 3, height / 2)
};

// Printed by flip_expected.py from the published evaluator, flip-evaluator 1.7.
constexpr Expected kExpected[] = {
    {"ramp", "brighter ramp", 96, 64, 67, 0.2331643, 0.192528f},
    {"checker", "shifted checker", 96, 64, 67, 0.2881676, 0.354930f},
    {"noise", "ramp", 96, 64, 67, 0.7674943, 0.770878f},
    {"lines", "noise", 61, 83, 67, 0.5937826, 0.529498f},
    {"green", "blue", 40, 30, 67, 1.0000000, 1.000000f},
    {"stains", "lines", 96, 64, 67, 0.5206240, 0.976659f},
    {"ramp", "ramp", 16, 16, 67, 0.0000000, 0.000000f},
    {"stains", "checker", 96, 64, 30, 0.8610134, 0.969844f},
    {"noise", "shifted checker", 5, 3, 67, 0.9478742, 0.943259f},
};

double mean(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(Flip, AgreesWithThePublishedEvaluator) {
  for (const Expected& e : kExpected) {
    SCOPED_TRACE(std::string(e.test) + " against " + e.reference);
    const auto errors = ldr_flip(picture(e.test, e.width, e.height), picture(e.reference, e.width, e.height), e.width,
                                 e.height, e.pixels_per_degree);
    EXPECT_NEAR(mean(errors), e.mean, 2e-5);
    EXPECT_NEAR(errors[static_cast<std::size_t>(e.height / 2 * e.width + e.width / 3)], e.one_pixel, 5e-5f);
  }
}

TEST(Flip, SameBitsForAnyNumberOfThreads) {
  const auto a = picture("stains", 96, 64);
  const auto b = picture("noise", 96, 64);
  const auto many = ldr_flip(a, b, 96, 64);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(ldr_flip(a, b, 96, 64), many);
}

TEST(Flip, RefusesWhatDoesNotFit) {
  const auto a = picture("ramp", 4, 4);
  EXPECT_THROW(ldr_flip(a, a, 4, 5), Error);
  EXPECT_THROW(ldr_flip(a, a, 4, 4, 0), Error);
  EXPECT_THROW(ldr_flip(a, a, 4, 4, std::nanf("")), Error);
}

}  // namespace
}  // namespace lightcuts
