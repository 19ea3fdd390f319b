// PNG through libpng. Its errors leave by longjmp, so the functions that call it hold plain data only.

#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <cstring>

#include "io/texture_decode_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

/// libpng's state, the bytes still to be read, and its last message.
struct PngReader {
  png_structp png = nullptr;
  png_infop info = nullptr;
  const std::uint8_t* next = nullptr;
  std::size_t left = 0;
  char message[160] = "out of memory";

  explicit PngReader(std::span<const std::uint8_t> bytes);
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
};

void on_error(png_structp png, png_const_charp message) {
  auto* reader = static_cast<PngReader*>(png_get_error_ptr(png));
  std::strncpy(reader->message, message, sizeof reader->message - 1);
  reader->message[sizeof reader->message - 1] = '\0';
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}  // odd colour profiles and the like: nothing that we use

void on_read(png_structp png, png_bytep out, std::size_t count) {
  auto* reader = static_cast<PngReader*>(png_get_io_ptr(png));
  if (count > reader->left) png_error(png, "the data ends too early");
  std::memcpy(out, reader->next, count);
  reader->next += count;
  reader->left -= count;
}

PngReader::PngReader(std::span<const std::uint8_t> bytes) : next(bytes.data()), left(bytes.size()) {
  png = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
  if (png != nullptr) info = png_create_info_struct(png);
}

/// Reads up to the pixels and asks for 8 bits a channel. False: see reader.message.
bool start(PngReader& reader) {
  if (reader.info == nullptr || setjmp(png_jmpbuf(reader.png))) return false;
  png_set_read_fn(reader.png, &reader, on_read);
  png_set_user_limits(reader.png, kMaxTextureSide, kMaxTextureSide);
  png_set_option(reader.png, PNG_SKIP_sRGB_CHECK_PROFILE, PNG_OPTION_ON);
  png_read_info(reader.png, reader.info);
  png_set_expand(reader.png);  // palettes to RGB, small greys to 8 bits, a transparent colour to alpha
  png_set_scale_16(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

/// Reads all rows and the end of the file. False: see reader.message.
bool read_rows(PngReader& reader, std::uint8_t* texels) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  const std::size_t stride = png_get_rowbytes(reader.png, reader.info);
  const png_uint_32 height = png_get_image_height(reader.png, reader.info);
  const int passes = png_get_interlace_type(reader.png, reader.info) == PNG_INTERLACE_ADAM7 ? 7 : 1;
  for (int pass = 0; pass < passes; ++pass) {
    for (png_uint_32 y = 0; y < height; ++y) png_read_row(reader.png, texels + y * stride, nullptr);
  }
  png_read_end(reader.png, nullptr);
  return true;
}

[[noreturn]] void fail(const std::string& name, const char* why) {
  throw Error(Code::malformed, fmt::format("{}: broken PNG: {}. Export the picture again.", name, why));
}

std::uint32_t big_endian(const std::uint8_t* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 | bytes[3];
}

}  // namespace

TextureHeader read_png_header(std::span<const std::uint8_t> bytes, const std::string& name) {
  // Signature 8, chunk length 4, "IHDR", width 4, height 4, depth, colour type.
  if (bytes.size() < 26 || std::memcmp(bytes.data() + 12, "IHDR", 4) != 0)
    fail(name, "it does not begin with a header");
  const std::uint32_t width = big_endian(bytes.data() + 16);
  const std::uint32_t height = big_endian(bytes.data() + 20);
  if (width == 0 || height == 0 || width > 0x7fffffffu || height > 0x7fffffffu) fail(name, "its size is out of range");
  const std::uint8_t color_type = bytes[25];
  const bool grey = color_type == PNG_COLOR_TYPE_GRAY || color_type == PNG_COLOR_TYPE_GRAY_ALPHA;
  return {static_cast<int>(width), static_cast<int>(height), grey ? 2 : 4};
}

TextureImage decode_png(std::span<const std::uint8_t> bytes, const std::string& name) {
  PngReader reader(bytes);
  if (!start(reader)) fail(name, reader.message);
  TextureImage image;
  image.name = name;
  image.width = static_cast<int>(png_get_image_width(reader.png, reader.info));
  image.height = static_cast<int>(png_get_image_height(reader.png, reader.info));
  image.channels = png_get_channels(reader.png, reader.info);
  const std::size_t row_bytes = png_get_rowbytes(reader.png, reader.info);
  if (row_bytes != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels)) {
    fail(name, "its rows have an unexpected length");
  }
  image.texels.resize(row_bytes * static_cast<std::size_t>(image.height));
  if (!read_rows(reader, image.texels.data())) fail(name, reader.message);
  return image;
}

}  // namespace lightcuts
