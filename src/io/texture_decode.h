#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "lightcuts/scene.h"

namespace lightcuts {

/// Decodes the bytes of a PNG or JPEG file, told by their content, into 8 bits a channel as the file has them (sRGB).
///
/// 1 to 4 channels; 16-bit pictures are reduced to 8 bits. The size in the file's header is checked before anything is
/// allocated. `name` names the picture in messages and in the result.
/// Throws Error{malformed, unsupported, out_of_memory}.
TextureImage decode_texture(std::span<const std::byte> bytes, const std::string& name);

}  // namespace lightcuts
