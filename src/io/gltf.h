#pragma once

#include <filesystem>

#include "lightcuts/io.h"

namespace lightcuts {

/// Reads glTF 2.0: a .gltf with its buffers and images, or a .glb. Not yet validated: see load_scene.
///
/// Nothing in the file is trusted: counts are checked against the bytes that exist before anything is allocated, and
/// only regular files below the scene's folder are opened.
/// Throws Error{file_missing, malformed, unsupported, invalid_scene, out_of_memory}.
LoadedScene load_gltf(const std::filesystem::path& path);

}  // namespace lightcuts
