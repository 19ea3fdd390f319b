#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lightcuts/image.h"
#include "lightcuts/render.h"

namespace lightcuts::app {

/// Where a picture goes, and how it is shown.
struct Outputs {
  std::vector<std::filesystem::path> pictures;  ///< .exr, .png, .hdr
  std::filesystem::path stats;                  ///< .json; "-": stdout; empty: none
  std::string layer;                            ///< shown by every .png in false colour; empty: the picture itself
  std::optional<float> exposure_ev;             ///< of every .png; nullopt: auto
};

/// Fills in the default outputs of a scene and checks all that can be known before the work: endings, names that occur
/// twice, folders, permissions, whether there will be such a layer.
/// Throws Error{invalid_argument, cannot_write}.
void prepare(Outputs& outputs, const std::string& scene_name, Method method);

/// Writes all pictures and says on stdout what was written and which exposure was chosen. If one fails the others are
/// still tried; then throws the first Error{cannot_write, disk_full}.
void write_pictures(const Outputs& outputs, const Image& image);

}  // namespace lightcuts::app
