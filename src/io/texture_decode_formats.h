#pragma once

// Inner header of texture_decode: one reader a format.

#include "io/texture_decode.h"

namespace lightcuts {

/// Largest side that is decoded [pixels]; JPEG cannot hold more, and no GPU takes larger textures.
inline constexpr int kMaxTextureSide = 65535;

TextureHeader read_png_header(std::span<const std::uint8_t> bytes, const std::string& name);
TextureImage decode_png(std::span<const std::uint8_t> bytes, const std::string& name);

TextureHeader read_jpeg_header(std::span<const std::uint8_t> bytes, const std::string& name);
TextureImage decode_jpeg(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace lightcuts
