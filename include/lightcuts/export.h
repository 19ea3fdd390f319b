#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lightcuts/scene.h"

namespace lightcuts {

/// Writes a scene for other programs, with its materials as this library renders them: Lambertian, on both sides.
///
/// By the ending of `path`: `.gltf` (with a `.bin` beside it) or `.glb`, glTF 2.0; `.xml`, Mitsuba 3 (with meshes as PLY and
/// textures in a folder of the same name beside it). The scene must have passed `validate`. Meshes, normals, texture
/// coordinates, materials, lights and cameras of a glTF file come back from load_scene as they were.
/// Returns a sentence for everything that the format cannot say. Throws Error{invalid_argument, cannot_write, disk_full}.
std::vector<std::string> export_scene(const std::filesystem::path& path, const Scene& scene);

}  // namespace lightcuts
