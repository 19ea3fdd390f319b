#pragma once

#include <map>
#include <string>

#include "io/gltf_buffers.h"

namespace lightcuts::gltf {

/// A primitive unpacked from KHR_draco_mesh_compression, as bytes that accessors can read.
struct DracoPrimitive {
  Bytes indices;                            ///< 32 bits each
  std::map<std::string, Bytes> attributes;  ///< by glTF's name, in the accessor's component type, packed
};

/// Decompresses a primitive. Counts in the stream's head are checked before the decoder allocates anything.
///
/// @param primitive    the mesh's primitive, whose accessors say the component types
/// @param compression  its extension object
/// Throws Error{malformed, unsupported}.
DracoPrimitive decode_draco(const JsonValue& primitive, const JsonValue& compression, Context& context,
                            Buffers& buffers);

}  // namespace lightcuts::gltf
