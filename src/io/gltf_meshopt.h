#pragma once

#include <span>

#include "io/gltf_context.h"
#include "io/gltf_uri.h"

namespace lightcuts::gltf {

/// Decompresses a buffer view with EXT_meshopt_compression.
///
/// @param view         the buffer view
/// @param compression  its extension object
/// @param data         the compressed bytes
/// @return             count * byteStride bytes
/// Throws Error{malformed, unsupported}.
Bytes decode_meshopt(const JsonValue& view, const JsonValue& compression, std::span<const std::byte> data,
                     MemoryBudget& budget);

}  // namespace lightcuts::gltf
