#include "lightcuts/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>

#include "lightcuts/error.h"

namespace lightcuts {
namespace {

Image grey(int width, int height, std::vector<float> values) {
  Image image = make_rgb_image(width, height);
  for (Channel& channel : image.channels) channel.values = values;
  return image;
}

TEST(Compare, EqualImagesHaveNoError) {
  const Image image = grey(3, 2, {0, 1, 2, 3, 4, 5});
  const Comparison c = compare(image, image);
  EXPECT_EQ(c.rmse, 0);
  EXPECT_EQ(c.relmse, 0);
  EXPECT_EQ(c.mean_relative_error, 0);
  EXPECT_EQ(c.p99_relative_error, 0);
  EXPECT_EQ(c.signed_relative_error, 0);
  EXPECT_EQ(c.flip, 0);
}

TEST(Compare, ValuesComputedByHand) {
  // m = 2; the pixel of 0.01 is darker than 0.02 and has no relative error.
  const Image b = grey(4, 1, {1, 2, 4.99f, 0.01f});
  const Image a = grey(4, 1, {1.5f, 1, 4.99f, 0.03f});
  const Comparison c = compare(a, b);
  EXPECT_NEAR(c.rmse, std::sqrt((0.25 + 1 + 0 + 0.0004) / 4), 1e-6);
  EXPECT_NEAR(c.relmse, (0.25 / 1.04 + 1 / 4.04 + 0.0004 / 0.0401) / 4, 1e-6);
  EXPECT_EQ(c.dark_pixels, 1u);
  EXPECT_NEAR(c.mean_relative_error, (0.5 + 0.5 + 0) / 3, 1e-6);
  EXPECT_NEAR(c.signed_relative_error, (0.5 - 0.5 + 0) / 3, 1e-6);
  EXPECT_NEAR(c.p99_relative_error, 0.5, 1e-6);
}

TEST(Compare, PercentileIsLinearBetweenRanks) {
  // Errors 0, 0.01, ..., 0.10 of eleven pixels: rank 9.9.
  std::vector<float> b(11, 1.0f), a;
  for (int i = 0; i < 11; ++i) a.push_back(1 + 0.01f * static_cast<float>((i * 7) % 11));
  EXPECT_NEAR(compare(grey(11, 1, a), grey(11, 1, b)).p99_relative_error, 0.099, 1e-6);
}

TEST(Compare, ChannelsCountEach) {
  Image b = make_rgb_image(1, 1);
  Image a = b;
  find_channel(b, "G")->values[0] = 1;
  find_channel(a, "G")->values[0] = 1;
  find_channel(a, "R")->values[0] = 3;
  EXPECT_NEAR(compare(a, b).rmse, std::sqrt(9.0 / 3), 1e-6);
}

TEST(Compare, BlackReference) {
  const Image black = grey(2, 1, {0, 0});
  EXPECT_EQ(compare(black, black).relmse, 0);
  const Comparison c = compare(grey(2, 1, {0, 1}), black);
  EXPECT_TRUE(std::isinf(c.relmse));
  EXPECT_TRUE(std::isinf(c.p99_relative_error));
  EXPECT_TRUE(std::isfinite(c.flip));
}

TEST(Compare, FlipIgnoresTheScaleOfBoth) {
  const Image b = grey(2, 2, {1, 2, 3, 4}), a = grey(2, 2, {1, 2, 3, 5});
  const Image b16 = grey(2, 2, {16, 32, 48, 64}), a16 = grey(2, 2, {16, 32, 48, 80});
  EXPECT_NEAR(compare(a, b).flip, compare(a16, b16).flip, 1e-6);
  EXPECT_NEAR(compare(a16, b16).exposure_ev, compare(a, b).exposure_ev - 4, 1e-5);
}

TEST(Compare, RefusesDifferentSizes) {
  try {
    compare(grey(2, 1, {0, 1}), grey(1, 2, {0, 1}));
    FAIL() << "was not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::invalid_argument);
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("2x1"), testing::HasSubstr("1x2")));
  }
}

TEST(Compare, NamesThePixelThatIsNotANumber) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    const Image good = grey(2, 2, {1, 1, 1, 1});
    Image broken = good;
    find_channel(broken, "B")->values[3] = bad;
    try {
      compare(broken, good);
      FAIL() << "was not refused";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("column 1, row 1"));
    }
    EXPECT_THROW(compare(good, broken), Error);
  }
}

TEST(Compare, SameBitsForAnyNumberOfThreads) {
  std::vector<float> b, a;
  for (int i = 0; i < 64 * 48; ++i) {
    b.push_back(static_cast<float>(i * 7919 % 1009) / 100);
    a.push_back(static_cast<float>(i * 104729 % 1013) / 100);
  }
  const Comparison many = compare(grey(64, 48, a), grey(64, 48, b));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Comparison single = compare(grey(64, 48, a), grey(64, 48, b));
  EXPECT_EQ(single.rmse, many.rmse);
  EXPECT_EQ(single.relmse, many.relmse);
  EXPECT_EQ(single.flip, many.flip);
}

}  // namespace
}  // namespace lightcuts
