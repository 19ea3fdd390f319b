#include <png.h>

#include "io/image_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {

std::vector<std::byte> encode_png(const DisplayImage& image) {
  // libpng's simplified interface: errors come back in the struct (no jumps across our frames), and 8-bit pictures
  // are marked with an sRGB chunk.
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;

  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::vector<std::byte> file(size);
  const int row_stride = 3 * image.width;
  if (png_image_write_to_memory(&png, file.data(), &size, 0, image.rgb.data(), row_stride, nullptr) == 0) {
    const std::string message = png.message;
    png_image_free(&png);
    throw Error(Code::invalid_argument, "libpng does not take this picture: " + message);
  }
  file.resize(size);
  return file;
}

}  // namespace lightcuts
