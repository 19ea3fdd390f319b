#pragma once

#include <filesystem>

#include "lightcuts/io.h"

namespace lightcuts {

/// Reads an OBJ file with its MTL files and their textures; the result is not validated yet.
///
/// One mesh an object (or group) and material, corners with equal position, normal and texture coordinates shared.
/// Kd is the albedo, Ke the radiance one to one, emitted by the front side. Opacity (d, Tr) below one half and map_d
/// become an alpha mask. Nothing outside the file's folder is opened. What cannot be used is left out with a warning.
/// Throws Error{file_missing, malformed, unsupported, out_of_memory}.
/// Source: Wavefront, "Object Files (.obj)" and "Material Library File (.mtl)", Advanced Visualizer appendices B1, B2.
LoadedScene load_obj(const std::filesystem::path& path);

}  // namespace lightcuts
