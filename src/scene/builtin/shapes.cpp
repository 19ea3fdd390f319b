#include "scene/builtin/shapes.h"

#include <utility>

namespace lightcuts {
namespace {

/// Corners of the six faces, counter-clockwise from outside, and their names.
struct Face {
  const char* name;
  std::array<int, 4> corners;
};
constexpr std::array<Face, 6> kFaces = {{{"-x", {0, 4, 6, 2}},
                                         {"+x", {1, 3, 7, 5}},
                                         {"-y", {0, 1, 5, 4}},
                                         {"+y", {2, 6, 7, 3}},
                                         {"-z", {0, 2, 3, 1}},
                                         {"+z", {4, 5, 7, 6}}}};

std::array<Vec3, 8> corners_of(Box box) {
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    corners[i] = {(i & 1) != 0 ? box.hi.x : box.lo.x, (i & 2) != 0 ? box.hi.y : box.lo.y,
                  (i & 4) != 0 ? box.hi.z : box.lo.z};
  }
  return corners;
}

}  // namespace

void add_quad(Mesh& mesh, Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

void add_ring(Mesh& mesh, const std::array<Vec3, 4>& outer, const std::array<Vec3, 4>& inner) {
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t next = (i + 1) % 4;
    add_quad(mesh, outer[i], outer[next], inner[next], inner[i]);
  }
}

void add_hexahedron(Mesh& mesh, const std::array<Vec3, 8>& corners) {
  for (const Face& face : kFaces) {
    const auto corner = [&](std::size_t i) { return corners[static_cast<std::size_t>(face.corners[i])]; };
    add_quad(mesh, corner(0), corner(1), corner(2), corner(3));
  }
}

void add_box(Mesh& mesh, Box box) { add_hexahedron(mesh, corners_of(box)); }

void add_room(Mesh& mesh, Box box, const std::string& open) {
  const std::array<Vec3, 8> corners = corners_of(box);
  for (const Face& face : kFaces) {
    if (open.find(face.name) != std::string::npos) continue;
    const auto corner = [&](std::size_t i) { return corners[static_cast<std::size_t>(face.corners[i])]; };
    add_quad(mesh, corner(3), corner(2), corner(1), corner(0));
  }
}

std::uint32_t add_material(Scene& scene, const std::string& name, Vec3 albedo, Vec3 emission) {
  Material material;
  material.name = name;
  material.base_color = albedo;
  material.emission = emission;
  scene.materials.push_back(material);
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

void add_mesh(Scene& scene, Mesh mesh, const std::string& name, std::uint32_t material) {
  mesh.name = name;
  mesh.material = material;
  scene.instances.push_back({name, static_cast<std::uint32_t>(scene.meshes.size()), {}});
  scene.meshes.push_back(std::move(mesh));
}

}  // namespace lightcuts
