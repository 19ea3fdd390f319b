#pragma once

#include <png.h>

#include <cstdint>
#include <string>
#include <vector>

namespace lightcuts::testing {

/// A PNG of 8 or 16 bits a channel (`samples` as stored, 16 bits in big-endian pairs); colour type 3 wants `palette`.
inline std::string png_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& samples,
                             int depth = 8, const std::vector<png_color>& palette = {},
                             const std::vector<std::uint8_t>& alpha = {}) {
  const int grey_to_rgba[] = {0, PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                              PNG_COLOR_TYPE_RGB_ALPHA};
  const int type = palette.empty() ? grey_to_rgba[channels] : PNG_COLOR_TYPE_PALETTE;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::string out;
  png_set_write_fn(
      png, &out,
      [](png_structp writer, png_bytep data, std::size_t size) {
        static_cast<std::string*>(png_get_io_ptr(writer))->append(reinterpret_cast<const char*>(data), size);
      },
      nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), depth, type,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!palette.empty()) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  if (!alpha.empty()) png_set_tRNS(png, info, alpha.data(), static_cast<int>(alpha.size()), nullptr);
  png_write_info(png, info);
  const std::size_t stride = png_get_rowbytes(png, info);
  for (int y = 0; y < height; ++y) png_write_row(png, samples.data() + static_cast<std::size_t>(y) * stride);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

}  // namespace lightcuts::testing
