#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "io/obj_text.h"
#include "lightcuts/math.h"
#include "lightcuts/scene.h"

namespace lightcuts::obj {

/// Indices of a triangle's corner, checked when it was read; kNone where there is no such thing.
struct Corner {
  std::uint32_t position = 0;
  std::uint32_t texcoord = kNone;
  std::uint32_t normal = kNone;  ///< kNone: flat; with kSmoothBit: to be computed over that smoothing group
};
inline constexpr std::uint32_t kSmoothBit = 0x80000000u;

/// Is the normal of a corner to be computed? kNone has the bit too, hence a function.
inline bool wants_smooth_normal(const Corner& corner) {
  return corner.normal != kNone && (corner.normal & kSmoothBit) != 0;
}

/// The triangles of one object and one material, three corners each.
struct Part {
  std::string name;
  std::uint32_t material = 0;  ///< index into Data::material_names
  std::vector<Corner> corners;
};

/// An OBJ file as it stands there, polygons cut into triangles.
struct Data {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Vec2> texcoords;                      ///< v points down, as in Mesh
  std::vector<std::array<std::uint8_t, 4>> colors;  ///< as in Mesh: empty or one a position
  std::vector<Part> parts;
  std::vector<std::string> material_names;  ///< as `usemtl` says; "" for faces before the first
  std::vector<std::string> libraries;       ///< the texts behind `mtllib`, each once
};

/// Reads an OBJ file. Faces whose indices lead nowhere are left out and noted.
/// Throws Error{file_missing, malformed, unsupported}.
Data parse(const std::filesystem::path& path, Notes& notes);

}  // namespace lightcuts::obj
