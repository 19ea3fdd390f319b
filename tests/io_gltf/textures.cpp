// PNG and JPEG bytes to 8-bit texels.

#include "io/texture_decode.h"

#include <gmock/gmock.h>

#include <cstdio>
// jpeglib.h needs FILE declared before it.
#include <jpeglib.h>

#include <fstream>
#include <sstream>

#include "corpus.h"
#include "png_bytes.h"

namespace lightcuts {
namespace {

using ::testing::ElementsAre;
using testing::png_bytes;

std::span<const std::byte> as_bytes(const std::string& text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

TextureImage decode(const std::string& bytes) { return decode_texture(as_bytes(bytes), "picture"); }

Code code_of(const std::string& bytes) {
  try {
    decode(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("picture"), 0u) << error.what();
    return error.code();
  }
  return Code::no_emitter;
}

/// A JPEG of one colour in 8 x 8 pixels.
std::string jpeg_bytes(J_COLOR_SPACE space, int components, const std::vector<std::uint8_t>& color) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &buffer, &size);
  info.image_width = info.image_height = 8;
  info.input_components = components;
  info.in_color_space = space;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 100, TRUE);
  jpeg_start_compress(&info, TRUE);
  std::vector<std::uint8_t> row;
  for (int x = 0; x < 8; ++x) row.insert(row.end(), color.begin(), color.end());
  JSAMPROW rows[1] = {row.data()};
  for (int y = 0; y < 8; ++y) jpeg_write_scanlines(&info, rows, 1);
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  const std::string out(reinterpret_cast<const char*>(buffer), size);
  free(buffer);
  return out;
}

TEST(Textures, PngOfEveryKind) {
  EXPECT_THAT(decode(png_bytes(2, 1, 1, {3, 250})).texels, ElementsAre(3, 250));
  EXPECT_THAT(decode(png_bytes(1, 1, 2, {3, 250})).texels, ElementsAre(3, 250));
  EXPECT_THAT(decode(png_bytes(1, 2, 3, {1, 2, 3, 4, 5, 6})).texels, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(decode(png_bytes(1, 1, 4, {1, 2, 3, 4})).texels, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(decode(png_bytes(2, 1, 1, {0x12, 0x34, 0xff, 0xff}, 16)).texels, ElementsAre(0x12, 0xff)) << "16 bits";
  EXPECT_THAT(decode(png_bytes(8, 1, 1, {0xa0}, 1)).texels, ElementsAre(255, 0, 255, 0, 0, 0, 0, 0)) << "1 bit";
  const std::vector<png_color> palette{{10, 20, 30}, {40, 50, 60}};
  EXPECT_THAT(decode(png_bytes(2, 1, 1, {1, 0}, 8, palette)).texels, ElementsAre(40, 50, 60, 10, 20, 30));
  const TextureImage clear = decode(png_bytes(2, 1, 1, {1, 0}, 8, palette, {7}));
  EXPECT_EQ(clear.channels, 4);
  EXPECT_THAT(clear.texels, ElementsAre(40, 50, 60, 255, 10, 20, 30, 7));
}

void expect_texel(const TextureImage& image, int channels, const std::vector<int>& color) {
  ASSERT_EQ(image.channels, channels);
  ASSERT_EQ(image.texels.size(), static_cast<std::size_t>(64 * channels));
  for (std::size_t c = 0; c < color.size(); ++c) EXPECT_NEAR(image.texels[c], color[c], 3) << c;
}

TEST(Textures, JpegOfEveryKind) {
  expect_texel(decode(jpeg_bytes(JCS_GRAYSCALE, 1, {77})), 1, {77});
  expect_texel(decode(jpeg_bytes(JCS_RGB, 3, {200, 100, 50})), 3, {200, 100, 50});
  // libjpeg marks CMYK as Adobe does, where values are inverted: 255 is no ink.
  expect_texel(decode(jpeg_bytes(JCS_CMYK, 4, {255, 128, 0, 128})), 3, {128, 64, 0});
}

TEST(Textures, CutFilesAreRefused) {
  const std::string png = png_bytes(16, 16, 3, std::vector<std::uint8_t>(768, 5));
  for (std::size_t size = 0; size < png.size(); ++size)
    EXPECT_EQ(code_of(png.substr(0, size)), Code::malformed) << size;
  const std::string jpeg = jpeg_bytes(JCS_RGB, 3, {200, 100, 50});
  for (std::size_t size = 0; size < 20; ++size) EXPECT_EQ(code_of(jpeg.substr(0, size)), Code::malformed) << size;
}

TEST(Textures, SizeIsCheckedBeforeDecoding) {
  std::string png = png_bytes(1, 1, 3, {1, 2, 3});
  png[16] = 0, png[17] = 0, png[18] = '\x7f', png[20] = 0, png[21] = 0, png[22] = '\x7f';
  EXPECT_EQ(read_texture_header(as_bytes(png), "picture").width, 0x7f01);
  EXPECT_EQ(code_of(png), Code::unsupported);
  png[16] = 1;
  EXPECT_EQ(code_of(png), Code::unsupported);
}

TEST(Textures, HostilePictures) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  std::ifstream list(testing::shared_scenes() / "malformed/own-hostile/EXPECTED.tsv");
  std::size_t seen = 0;
  for (std::string line; std::getline(list, line);) {
    if (!line.starts_with("image/")) continue;
    const std::string file = line.substr(0, line.find('\t'));
    SCOPED_TRACE(line);
    std::ifstream picture(testing::shared_scenes() / "malformed/own-hostile" / file, std::ios::binary);
    std::ostringstream bytes;
    bytes << picture.rdbuf();
    ++seen;
    const Code code = code_of(bytes.str());
    if (line.find("LOADS") == std::string::npos) {
      EXPECT_NE(code, Code::no_emitter) << "it was decoded";
    }
  }
  EXPECT_EQ(seen, 15u);
}

}  // namespace
}  // namespace lightcuts
