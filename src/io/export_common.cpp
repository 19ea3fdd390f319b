#include <png.h>

#include <algorithm>

#include "io/export_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {

std::vector<std::byte> encode_texture_png(const TextureImage& image) {
  constexpr png_uint_32 formats[] = {PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB, PNG_FORMAT_RGBA};
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = formats[std::clamp(image.channels, 1, 4) - 1];
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::vector<std::byte> file(size);
  if (png_image_write_to_memory(&png, file.data(), &size, 0, image.texels.data(), image.channels * image.width,
                                nullptr) == 0) {
    const std::string message = png.message;
    png_image_free(&png);
    throw Error(Code::invalid_argument, "libpng does not take the texture '" + image.name + "': " + message);
  }
  file.resize(size);
  return file;
}

std::vector<Camera> exported_cameras(const Scene& scene) {
  return scene.cameras.empty() ? std::vector<Camera>{select_camera(scene, "")} : scene.cameras;
}

void ExportWarnings::add(const std::string& sentence) {
  if (std::find(sentences_.begin(), sentences_.end(), sentence) == sentences_.end()) sentences_.push_back(sentence);
}

}  // namespace lightcuts
