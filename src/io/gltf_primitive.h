#pragma once

#include "io/gltf_accessors.h"
#include "lightcuts/scene.h"

namespace lightcuts::gltf {

/// Which sets of texture coordinates a primitive's material reads.
struct WantedTexcoords {
  bool set[2] = {false, false};
};

/// True if a primitive is made of triangles and has positions; says in a warning what else it is.
bool has_triangles(const JsonValue& primitive, Context& context);

/// Reads the triangles and the vertex attributes of one primitive, morph targets at the mesh's weights included.
///
/// Texture coordinates are read only where wanted. Throws Error{malformed, unsupported, file_missing}.
void read_geometry(const JsonValue& mesh, const JsonValue& primitive, WantedTexcoords wanted, Context& context,
                   Buffers& buffers, Mesh& out);

}  // namespace lightcuts::gltf
