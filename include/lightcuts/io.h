#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lightcuts/image.h"
#include "lightcuts/scene.h"

namespace lightcuts {

/// A scene and what a person should know of how it was read (each a whole sentence, each said once).
struct LoadedScene {
  Scene scene;
  std::vector<std::string> warnings;
};

/// Reads a scene from a file: glTF 2.0 (.gltf, .glb) or OBJ with MTL, told by content and ending.
/// The result is validated. Throws Error{file_missing, malformed, unsupported, invalid_scene, out_of_memory}.
LoadedScene load_scene(const std::filesystem::path& path);

/// Reads a picture: .exr (all channels of the first part), .hdr, .png or .jpg (decoded from sRGB to linear R, G, B and A
/// where there is one). Throws Error{file_missing, malformed, unsupported, out_of_memory}.
Image load_image(const std::filesystem::path& path);

/// Writes .exr (all planes, 32-bit float, ZIP, attributes as strings) or .hdr (R, G, B), told by the ending.
/// The file is written beside its name and renamed: it is whole or not there.
/// Throws Error{invalid_argument, cannot_write, disk_full}.
void save_image(const std::filesystem::path& path, const Image& image);

/// Writes a .png; same guarantees and errors as save_image.
void save_png(const std::filesystem::path& path, const DisplayImage& image);

/// Writes text to a file with the same guarantees and errors as save_image.
void save_text(const std::filesystem::path& path, const std::string& text);

/// Throws Error{cannot_write} now rather than after hours of work: the folder must exist and take a new file, an
/// existing file must be writable, the ending must be one of `.exr .png .hdr .json`.
void check_writable(const std::filesystem::path& path);

}  // namespace lightcuts
