#pragma once

#include "io/gltf_context.h"
#include "io/gltf_meshes.h"
#include "lightcuts/scene.h"

namespace lightcuts::gltf {

/// Walks the default scene (scene 0 if none is named, all root nodes if there are no scenes) and adds its instances,
/// cameras and lights to `scene`.
///
/// A node that is reached twice, or that is its own ancestor, is refused; the depth of the tree is not limited.
/// Throws Error{malformed, unsupported, file_missing}.
void read_nodes(Context& context, Buffers& buffers, Meshes& meshes, Scene& scene);

}  // namespace lightcuts::gltf
