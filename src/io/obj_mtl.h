#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/obj_text.h"
#include "lightcuts/math.h"

namespace lightcuts::obj {

/// A picture as an MTL statement names it, with the options that we honour.
struct MtlMap {
  std::string text;                   ///< what follows the options: the file's name, spaces included
  std::array<float, 2> offset{0, 0};  ///< -o
  std::array<float, 2> scale{1, 1};   ///< -s
  bool clamp = false;                 ///< -clamp on
  [[nodiscard]] bool present() const { return !text.empty(); }
};

/// One `newmtl` of an MTL file.
struct MtlMaterial {
  std::string name;
  std::optional<Vec3> kd, ke;
  std::optional<float> opacity;  ///< d, or 1 - Tr where there is no d
  bool has_d = false;
  std::optional<float> metallic, roughness;  ///< Pm, Pr
  MtlMap map_kd, map_ke, map_d;
};

/// Reads an MTL file. Throws Error{file_missing, malformed}.
std::vector<MtlMaterial> parse_mtl(const std::filesystem::path& path, Notes& notes);

}  // namespace lightcuts::obj
