#include "io/texture_decode.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "io/texture_decode_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

enum class Format : std::uint8_t { png, jpeg };

Format format_of(std::span<const std::uint8_t> bytes, const std::string& name) {
  constexpr std::array<std::uint8_t, 8> png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  constexpr std::array<std::uint8_t, 3> jpeg{0xff, 0xd8, 0xff};
  const auto starts_with = [&](std::span<const std::uint8_t> magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
  };
  if (starts_with(png)) return Format::png;
  if (starts_with(jpeg)) return Format::jpeg;
  throw Error(
      Code::malformed,
      fmt::format("{}: {}; expected a PNG or JPEG picture. Export the texture again in one of these formats.", name,
                  bytes.empty() ? "the picture is empty" : "the first bytes are those of another format"));
}

/// The C libraries speak of bytes as of numbers.
std::span<const std::uint8_t> as_numbers(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

}  // namespace

TextureHeader read_texture_header(std::span<const std::byte> data, const std::string& name) {
  const std::span<const std::uint8_t> bytes = as_numbers(data);
  const TextureHeader header =
      format_of(bytes, name) == Format::png ? read_png_header(bytes, name) : read_jpeg_header(bytes, name);
  if (header.width > kMaxTextureSide || header.height > kMaxTextureSide) {
    throw Error(Code::unsupported,
                fmt::format("{}: the picture has {} x {} pixels; at most {} a side are read. Scale it down.", name,
                            header.width, header.height, kMaxTextureSide));
  }
  return header;
}

TextureImage decode_texture(std::span<const std::byte> data, const std::string& name, std::size_t max_bytes) {
  const TextureHeader header = read_texture_header(data, name);
  if (header.byte_count() > max_bytes) {
    throw Error(Code::unsupported,
                fmt::format("{}: the picture's header asks for {} x {} pixels of up to {} bytes, above the limit of {} "
                            "MiB. Scale it down.",
                            name, header.width, header.height, header.channels, max_bytes >> 20));
  }
  const std::span<const std::uint8_t> bytes = as_numbers(data);
  return format_of(bytes, name) == Format::png ? decode_png(bytes, name) : decode_jpeg(bytes, name);
}

}  // namespace lightcuts
