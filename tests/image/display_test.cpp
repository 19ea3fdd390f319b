#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "lightcuts/error.h"
#include "lightcuts/image.h"

namespace lightcuts {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
const float kNan = std::nanf("");

Image grey(std::vector<float> values) {
  Image image = make_rgb_image(static_cast<int>(values.size()), 1);
  for (Channel& channel : image.channels) channel.values = values;
  return image;
}

TEST(AutoExposure, MiddleGreyStays) { EXPECT_NEAR(auto_exposure(grey({0.18f, 0.18f, 0.18f})), 0, 1e-4); }

TEST(AutoExposure, EightTimesDarkerIsThreeStops) {
  const Image image = grey({0.1f, 0.2f, 0.7f});
  const Image dark = grey({0.1f / 8, 0.2f / 8, 0.7f / 8});
  EXPECT_NEAR(auto_exposure(dark), auto_exposure(image) + 3, 1e-4);
}

TEST(AutoExposure, VisibleLampDoesNotDecide) {
  std::vector<float> room(100, 0.18f);
  for (std::size_t i = 0; i < 4; ++i) room[i] = 1e4f;
  EXPECT_NEAR(auto_exposure(grey(room)), 0, 1e-3);
}

TEST(AutoExposure, BlackAndBrokenPixelsDoNotCount) {
  EXPECT_EQ(auto_exposure(grey({0, 0, 0})), 0);
  EXPECT_EQ(auto_exposure(grey({0, kNan, -1})), 0);
  EXPECT_NEAR(auto_exposure(grey({0, 0.18f, kNan, kInf})), 0, 1e-4);
}

TEST(ToneMap, KnownCodes) {
  // 0.18 is the sRGB code 118; 0.6 is 203, where the curve leaves the identity; 1 becomes 0.8, code 231.
  const DisplayImage out = tone_map(grey({0, 0.18f, 0.6f, 1, kInf, kNan, -1}), 0);
  ASSERT_EQ(out.rgb.size(), 21u);
  std::vector<int> reds;
  for (std::size_t i = 0; i < 7; ++i) reds.push_back(out.rgb[3 * i]);
  EXPECT_THAT(reds, testing::ElementsAre(0, 118, 203, 231, 255, 0, 0));
}

TEST(ToneMap, ExposureDoublesAndKeepsColour) {
  Image image = make_rgb_image(1, 1);
  find_channel(image, "R")->values[0] = 0.09f;
  find_channel(image, "B")->values[0] = 0.045f;
  const DisplayImage out = tone_map(image, 1);
  EXPECT_EQ(out.rgb[0], 118);
  EXPECT_EQ(out.rgb[1], 0);
  EXPECT_EQ(out.rgb[2], 85);  // 0.09
}

TEST(ToneMap, NeverDecreases) {
  std::vector<float> values;
  for (int i = 0; i < 2000; ++i) values.push_back(static_cast<float>(i) * 0.005f);
  const DisplayImage out = tone_map(grey(values), 0);
  for (std::size_t i = 1; i < values.size(); ++i) ASSERT_GE(out.rgb[3 * i], out.rgb[3 * i - 3]) << values[i];
}

TEST(FalseColour, EndsAndLegend) {
  Image image;
  image.width = 4;
  image.height = 1;
  image.channels.push_back({"cut.size", {10, 300, kNan, 20}});
  const FalseColour out = false_colour(image, "cut.size");
  EXPECT_EQ(out.low, 10);
  EXPECT_EQ(out.high, 300);
  EXPECT_EQ(out.not_finite, 1u);
  const std::vector<int> rgb(out.picture.rgb.begin(), out.picture.rgb.end());
  EXPECT_THAT(std::vector<int>(rgb.begin(), rgb.begin() + 9),
              testing::ElementsAre(68, 1, 84, 253, 231, 37, 128, 128, 128));
}

TEST(FalseColour, ConstantPlaneAndOutOfRange) {
  const std::vector<float> values{5, 5, -100, 100};
  EXPECT_EQ(false_colour(2, 2, values, 5, 5).picture.rgb[0], 68);
  const DisplayImage clamped = false_colour(2, 2, values, 0, 10).picture;
  EXPECT_EQ(clamped.rgb[6], 68);
  EXPECT_EQ(clamped.rgb[9], 253);
}

TEST(FalseColour, UnknownLayerListsWhatIsThere) {
  try {
    false_colour(grey({1}), "depth");
    FAIL() << "was not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::invalid_argument);
    EXPECT_THAT(error.what(), testing::HasSubstr("R, G, B"));
  }
}

}  // namespace
}  // namespace lightcuts
