#include <algorithm>
#include <array>
#include <cctype>

#include "io/image_ending.h"
#include "io/image_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

void require_size(int width, int height) {
  // 2^30 pixels: strides and byte counts of every format stay inside its integers.
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 30;
  constexpr int kMaxSide = 1'000'000;  // libpng's limit
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide || std::int64_t{width} * height > kMaxPixels) {
    throw Error(Code::invalid_argument,
                "a picture of " + std::to_string(width) + " x " + std::to_string(height) + " pixels cannot be written");
  }
}

void require_planes(const Image& image) {
  require_size(image.width, image.height);
  if (image.channels.empty()) throw Error(Code::invalid_argument, "a picture without channels cannot be written");
  for (const Channel& channel : image.channels) {
    if (channel.values.size() != image.pixel_count()) {
      throw Error(Code::invalid_argument, "the channel '" + channel.name + "' has " +
                                              std::to_string(channel.values.size()) + " values, the picture has " +
                                              std::to_string(image.pixel_count()) + " pixels");
    }
  }
}

[[noreturn]] void throw_unknown_ending(const std::filesystem::path& path, const std::string& expected, Code code) {
  throw Error(code, "'" + path.string() + "' does not say in which format to write: its name must end in " + expected);
}

}  // namespace

std::string lower_case_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

void save_image(const std::filesystem::path& path, const Image& image) {
  const std::string ending = lower_case_ending(path);
  if (ending != ".exr" && ending != ".hdr") throw_unknown_ending(path, ".exr or .hdr", Code::invalid_argument);
  require_planes(image);
  if (ending == ".hdr") {
    const std::string bytes = encode_hdr(image);
    write_file(path, std::as_bytes(std::span(bytes)));
    return;
  }
  AtomicFile file(path);
  write_exr(file, image);
  file.commit();
}

void save_png(const std::filesystem::path& path, const DisplayImage& image) {
  if (lower_case_ending(path) != ".png") throw_unknown_ending(path, ".png", Code::invalid_argument);
  require_size(image.width, image.height);
  if (image.rgb.size() != std::size_t{3} * image.width * image.height) {
    throw Error(Code::invalid_argument, "the picture for '" + path.string() + "' has " +
                                            std::to_string(image.rgb.size()) + " bytes, not three a pixel");
  }
  write_file(path, encode_png(image));
}

void save_text(const std::filesystem::path& path, const std::string& text) {
  write_file(path, std::as_bytes(std::span(text)));
}

void check_writable(const std::filesystem::path& path) {
  static constexpr std::array<const char*, 4> kEndings{".exr", ".png", ".hdr", ".json"};
  // Ending last: a folder that was named by mistake deserves the sentence about folders.
  require_writable_place(path);
  const std::string ending = lower_case_ending(path);
  if (std::find(kEndings.begin(), kEndings.end(), ending) == kEndings.end()) {
    throw_unknown_ending(path, ".exr, .png, .hdr or .json", Code::cannot_write);
  }
}

}  // namespace lightcuts
