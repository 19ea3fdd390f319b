#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "lightcuts/io.h"
#include "support/expect_error.h"
#include "support/shared_scenes.h"
#include "support/temporary_folder.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::FloatNear;

fs::path shared(const std::string& name) { return test::shared_scenes() / name; }

std::vector<std::string> channel_names(const Image& image) {
  std::vector<std::string> names;
  for (const Channel& channel : image.channels) names.push_back(channel.name);
  return names;
}

std::vector<float> values(const Image& image, const std::string& name) {
  const Channel* channel = find_channel(image, name);
  EXPECT_NE(channel, nullptr) << name;
  return channel == nullptr ? std::vector<float>() : channel->values;
}

TEST(ExrRoundTrip, EveryBitOfEveryPlaneAndEveryAttributeComesBack) {
  const TemporaryFolder folder;
  constexpr float kInf = std::numeric_limits<float>::infinity();
  Image image = make_rgb_image(5, 3);
  for (const char* name : {"depth.Z", "cut.size", "albedo.R", "weight"}) ensure_channel(image, name);
  std::uint32_t bits = 12345;
  for (Channel& channel : image.channels) {
    for (float& v : channel.values) v = std::bit_cast<float>(bits = bits * 1664525u + 1013904223u);
  }
  image.channels[0].values = {0,  -0.0f,  kInf,     -kInf,     std::numeric_limits<float>::quiet_NaN(),
                              -1, 1e-45f, 3.4e38f,  1e-30f,    0.1f,
                              7,  -7,     16777216, -1.5e-20f, 65504};
  image.attributes = {{"complete", "false"}, {"comments", "two\nlines \xc3\xa9"}};
  save_image(folder / "a.exr", image);
  const Image loaded = load_image(folder / "a.exr");
  EXPECT_EQ(loaded.width, 5);
  EXPECT_EQ(loaded.height, 3);
  EXPECT_EQ(loaded.attributes, image.attributes);
  EXPECT_EQ(loaded.channels.size(), image.channels.size());
  for (const Channel& channel : image.channels) {
    const std::vector<float> back = values(loaded, channel.name);
    ASSERT_EQ(back.size(), channel.values.size());
    for (std::size_t i = 0; i < back.size(); ++i) {
      EXPECT_EQ(std::bit_cast<std::uint32_t>(back[i]), std::bit_cast<std::uint32_t>(channel.values[i]))
          << channel.name << i;
    }
  }
}

TEST(ExrRoundTrip, LargePictureOfManyPlanes) {
  const TemporaryFolder folder;
  Image image = make_rgb_image(301, 203);
  for (int layer = 0; layer < 12; ++layer) ensure_channel(image, "layer" + std::to_string(layer) + ".v");
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    for (std::size_t i = 0; i < image.pixel_count(); ++i)
      image.channels[c].values[i] = std::sin(static_cast<float>(i * (c + 1)));
  }
  save_image(folder / "a.exr", image);
  const Image loaded = load_image(folder / "a.exr");
  for (const Channel& channel : image.channels) EXPECT_EQ(values(loaded, channel.name), channel.values) << channel.name;
}

// The largest component has 8 bits: half a step of 1/128 of it at most; a smaller one shares its exponent.
TEST(HdrRoundTrip, WithinThePrecisionOfTheFormat) {
  const TemporaryFolder folder;
  for (const int width : {3, 7, 8, 130, 700}) {  // flat below 8, runs from there on
    Image image = make_rgb_image(width, 4);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < image.pixel_count(); ++i) {
        const bool constant = i % 97 < 50;  // long runs and noise
        image.channels[c].values[i] =
            constant ? 0.25f
                     : std::exp(30 * std::sin(static_cast<float>(i))) * (1 + std::cos(static_cast<float>(i * c)));
      }
    }
    save_image(folder / "a.hdr", image);
    const Image loaded = load_image(folder / "a.hdr");
    ASSERT_EQ(loaded.width, width);
    ASSERT_EQ(loaded.height, 4);
    const std::vector<Vec3> expected = rgb_pixels(image), actual = rgb_pixels(loaded);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const float step = max_component(expected[i]) / 128;
      const Vec3 error = actual[i] - expected[i];
      for (int axis = 0; axis < 3; ++axis) EXPECT_LE(std::fabs(component(error, axis)), 0.5f * step) << i;
    }
  }
}

TEST(HdrRoundTrip, WhatTheFormatCannotHoldBecomesItsNearestNeighbour) {
  const TemporaryFolder folder;
  constexpr float kInf = std::numeric_limits<float>::infinity();
  Image image = make_rgb_image(8, 1);
  image.channels[0].values = {-1, std::numeric_limits<float>::quiet_NaN(), kInf, 1e-42f, 0, 0.998f, 1.0f, 3e38f};
  save_image(folder / "a.hdr", image);
  const std::vector<float> r = values(load_image(folder / "a.hdr"), "R");
  const float largest = std::ldexp(255.0f, 119);
  EXPECT_THAT(r, ElementsAre(0, 0, largest, 0, 0, FloatNear(0.998f, 0.002f), 1, largest));
}

std::string hdr_of(const std::string& header, const std::string& size, int texels) {
  std::string file = "#?RADIANCE\n" + header + "\n" + size + "\n";
  for (int i = 0; i < texels; ++i) file += {static_cast<char>(128 + i), 64, 32, static_cast<char>(129)};
  return file;
}

TEST(Hdr, ExposureIsDividedOut) {
  const TemporaryFolder folder;
  write_whole(folder / "a.hdr", hdr_of("FORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE= 4.0\n", "-Y 1 +X 1", 1));
  EXPECT_THAT(values(load_image(folder / "a.hdr"), "R"), ElementsAre(0.125f));
  for (const char* bad : {"0", "-1", "x", "nan", "inf", ""}) {
    write_whole(folder / "a.hdr", hdr_of(std::string("EXPOSURE=") + bad + "\n", "-Y 1 +X 1", 1));
    expect_error(Code::malformed, "EXPOSURE", [&] { load_image(folder / "a.hdr"); });
  }
}

TEST(Hdr, AllEightOrientations) {
  const TemporaryFolder folder;
  const auto red = [&](const std::string& size) {
    write_whole(folder / "a.hdr", hdr_of("", size, 6));
    const Image image = load_image(folder / "a.hdr");
    std::vector<int> order;
    for (const float v : values(image, "R")) order.push_back(static_cast<int>(std::lround(v * 128)) - 128);
    EXPECT_EQ(image.width, size.find("X 3") != std::string::npos ? 3 : 2) << size;
    return order;
  };
  EXPECT_THAT(red("-Y 2 +X 3"), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(red("-Y 2 -X 3"), ElementsAre(2, 1, 0, 5, 4, 3));
  EXPECT_THAT(red("+Y 2 +X 3"), ElementsAre(3, 4, 5, 0, 1, 2));
  EXPECT_THAT(red("+Y 2 -X 3"), ElementsAre(5, 4, 3, 2, 1, 0));
  EXPECT_THAT(red("+X 3 -Y 2"), ElementsAre(0, 2, 4, 1, 3, 5));
  EXPECT_THAT(red("+X 3 +Y 2"), ElementsAre(1, 3, 5, 0, 2, 4));
  EXPECT_THAT(red("-X 3 -Y 2"), ElementsAre(4, 2, 0, 5, 3, 1));
  EXPECT_THAT(red("-X 3 +Y 2"), ElementsAre(5, 3, 1, 4, 2, 0));
}

TEST(Hdr, OldRunLengths) {
  const TemporaryFolder folder;
  std::string file = "#?RADIANCE\n\n-Y 1 +X 300\n";
  file += {static_cast<char>(128), 0, 0, static_cast<char>(129)};
  file += {1, 1, 1, 42};  // 42 + 1 * 256 repeats
  file += {1, 1, 1, 1};
  file += {64, 0, 0, static_cast<char>(129)};
  write_whole(folder / "a.hdr", file);
  const std::vector<float> r = values(load_image(folder / "a.hdr"), "R");
  EXPECT_EQ(std::count(r.begin(), r.end(), 1.0f), 299);
  EXPECT_EQ(r.back(), 0.5f);
}

TEST(LoadImage, PngBecomesLinear) {
  const TemporaryFolder folder;
  save_png(folder / "a.png", {2, 1, {0, 255, 188, 10, 11, 12}});
  const Image image = load_image(folder / "a.png");
  EXPECT_THAT(channel_names(image), ElementsAre("R", "G", "B"));
  EXPECT_THAT(values(image, "R"), ElementsAre(0, FloatNear(0.0030352698f, 1e-8f)));
  EXPECT_THAT(values(image, "G"), ElementsAre(1, FloatNear(0.0033465358f, 1e-8f)));
  EXPECT_THAT(values(image, "B"), ElementsAre(FloatNear(0.5028865f, 1e-6f), FloatNear(0.0036765073f, 1e-8f)));
}

TEST(LoadImage, IsToldByContentNotByEnding) {
  const TemporaryFolder folder;
  save_png(folder / "a.png", {1, 1, {1, 2, 3}});
  fs::rename(folder / "a.png", folder / "a.exr");
  EXPECT_EQ(load_image(folder / "a.exr").channels.size(), 3u);
  write_whole(folder / "text.exr", "hello");
  expect_error(Code::malformed, "promises", [&] { load_image(folder / "text.exr"); });
  write_whole(folder / "text.txt", "hello");
  expect_error(Code::unsupported, "OpenEXR, Radiance HDR, PNG or JPEG", [&] { load_image(folder / "text.txt"); });
  expect_error(Code::file_missing, "missing.exr", [&] { load_image(folder / "missing.exr"); });
  expect_error(Code::file_missing, "folder", [&] { load_image(folder.path()); });
}

TEST(SharedImages, AllOpen) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  int count = 0;
  for (const char* folder : {"image", "env"}) {
    for (const auto& entry : fs::recursive_directory_iterator(shared(folder))) {
      if (!entry.is_regular_file() || entry.path().extension() == ".md") continue;
      if (entry.path().filename() == "rgba-binary-alpha-iphone.png") continue;  // Apple's variant is no PNG
      SCOPED_TRACE(entry.path());
      ++count;
      try {
        const Image image = load_image(entry.path());
        EXPECT_GT(image.pixel_count(), 0u);
        for (const Channel& channel : image.channels) EXPECT_EQ(channel.values.size(), image.pixel_count());
      } catch (const Error& e) {
        ADD_FAILURE() << e.what();
      }
    }
  }
  EXPECT_GE(count, 54);
}

}  // namespace
}  // namespace lightcuts
