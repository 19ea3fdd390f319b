#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "lightcuts/scene.h"

namespace lightcuts {

/// Largest picture that is decoded, in bytes of texels: 16384 x 16384 in RGB and a little more.
inline constexpr std::size_t kMaxTextureBytes = std::size_t{1} << 30;

/// What the header of a picture promises.
struct TextureHeader {
  int width = 0;
  int height = 0;
  int channels = 0;  ///< at most: palettes and greys may turn out to have no alpha

  [[nodiscard]] std::size_t byte_count() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(channels);
  }
};

/// Reads the size of a PNG or JPEG from its first bytes; nothing is decoded or allocated.
///
/// @param bytes  the whole file
/// @param name   how messages call the picture
/// Throws Error{malformed} if it is neither format or its header is broken, Error{unsupported} above 65535 pixels a
/// side.
TextureHeader read_texture_header(std::span<const std::byte> bytes, const std::string& name);

/// Decodes a PNG or JPEG (told by content) to 8 bits a channel, as stored: no gamma or profile is applied.
///
/// Palettes become RGB or RGBA, 16 bits are rounded to 8, one to four bits of grey are spread to 0..255, and CMYK
/// becomes RGB. Throws Error{malformed} for broken or cut data, Error{unsupported} above 65535 pixels a side or
/// where the header alone asks for more than `max_bytes`.
TextureImage decode_texture(std::span<const std::byte> bytes, const std::string& name,
                            std::size_t max_bytes = kMaxTextureBytes);

}  // namespace lightcuts
