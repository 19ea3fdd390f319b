#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "command.h"
#include "lightcuts/io.h"

namespace lightcuts::test {
namespace {

using testing::HasSubstr;

/// A folder with b.exr, a.exr that is 10 % brighter, and small.exr of another size.
class CompareCommand : public testing::Test {
 protected:
  void SetUp() override {
    save("b.exr", 8, 1.0f);
    save("a.exr", 8, 1.1f);
    save("small.exr", 4, 1.0f);
  }

  void save(const std::string& name, int width, float factor) {
    Image image = make_rgb_image(width, 6);
    for (Channel& channel : image.channels) {
      for (std::size_t i = 0; i < channel.values.size(); ++i)
        channel.values[i] = factor * static_cast<float>(1 + i % 5);
    }
    save_image(folder_ / name, image);
  }

  ProgramResult compare(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "compare");
    ProgramOptions options;
    options.folder = folder_.path();
    return run_lightcuts(arguments, options);
  }

  TemporaryFolder folder_;
};

TEST_F(CompareCommand, EqualImages) {
  const ProgramResult r = compare({"b.exr", "b.exr", "--max-relmse", "0", "--max-flip", "0"});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(r.out, HasSubstr("rmse"));
}

TEST_F(CompareCommand, JsonHasTheFiguresOfTheContract) {
  const ProgramResult r = compare({"a.exr", "b.exr", "--json"});
  ASSERT_EQ(r.status, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  EXPECT_NEAR(json.at("mean_relative_error").get<double>(), 0.1, 1e-5);
  EXPECT_NEAR(json.at("signed_relative_error").get<double>(), 0.1, 1e-5);
  EXPECT_NEAR(json.at("p99_relative_error").get<double>(), 0.1, 1e-5);
  for (const auto& error : json.at("channel_relative_error")) EXPECT_NEAR(error.get<double>(), 0.1, 1e-5);
  EXPECT_GT(json.at("rmse").get<double>(), 0.1);
  EXPECT_GT(json.at("relmse").get<double>(), 0.005);
  EXPECT_GT(json.at("flip").get<double>(), 0.001);
}

TEST_F(CompareCommand, StatusOnePastALimit) {
  EXPECT_EQ(compare({"a.exr", "b.exr", "--max-relmse", "1e-4"}).status, 1);
  EXPECT_EQ(compare({"a.exr", "b.exr", "--max-flip", "1e-4"}).status, 1);
  EXPECT_EQ(compare({"a.exr", "b.exr", "--max-relmse", "0.5", "--max-flip", "0.5"}).status, 0);
  EXPECT_THAT(compare({"a.exr", "b.exr", "--max-flip", "0"}).err, HasSubstr("above the limit"));
}

TEST_F(CompareCommand, HeatmapHasTheImagesSize) {
  ASSERT_EQ(compare({"a.exr", "b.exr", "--heatmap", "heat.png"}).status, 0);
  const Image heat = load_image(folder_ / "heat.png");
  EXPECT_EQ(heat.width, 8);
  EXPECT_EQ(heat.height, 6);
}

TEST_F(CompareCommand, BadInputIsThree) {
  EXPECT_EQ(compare({"missing.exr", "b.exr"}).status, 3);
  EXPECT_EQ(compare({"small.exr", "b.exr"}).status, 3);
  EXPECT_THAT(compare({"small.exr", "b.exr"}).err, HasSubstr("4x6"));
  std::ofstream(folder_ / "broken.exr") << "no picture";
  EXPECT_EQ(compare({"broken.exr", "b.exr"}).status, 3);
}

TEST_F(CompareCommand, WrongUsageIsTwo) {
  EXPECT_EQ(compare({"a.exr"}).status, 2);
  EXPECT_EQ(compare({"a.exr", "b.exr", "--max-flip", "x"}).status, 2);
  EXPECT_EQ(compare({"a.exr", "b.exr", "--heatmap", "heat.exr"}).status, 2);
  EXPECT_EQ(compare({"a.exr", "b.exr", "--heatmap", "no/such/folder/heat.png"}).status, 2);
}

TEST_F(CompareCommand, HeatmapNeverOverwritesAnInput) {
  ASSERT_EQ(compare({"a.exr", "b.exr", "--heatmap", "heat.png"}).status, 0);
  EXPECT_EQ(compare({"heat.png", "b.exr", "--heatmap", "heat.png"}).status, 2);
}

}  // namespace
}  // namespace lightcuts::test
