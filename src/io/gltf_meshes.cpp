#include "io/gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/gltf_primitive.h"

namespace lightcuts::gltf {
namespace {

WantedTexcoords wanted_by(const Material& material) {
  WantedTexcoords wanted;
  for (const TextureRef* texture : {&material.base_color_texture, &material.emission_texture}) {
    if (texture->present()) wanted.set[texture->texcoord] = true;
  }
  return wanted;
}

bool has_transparent_vertex(const Mesh& mesh) {
  return std::any_of(mesh.colors.begin(), mesh.colors.end(), [](const auto& color) { return color[3] < 255; });
}

}  // namespace

const std::vector<std::uint32_t>& Meshes::use(const JsonValue& reference) {
  const JsonValue mesh = reference.follow(context_.array("meshes"), "a mesh");
  const auto [entry, is_new] = primitives_.try_emplace(reference.count());
  if (is_new) read_mesh(mesh, reference.count(), entry->second);
  return entry->second;
}

void Meshes::read_mesh(const JsonValue& mesh, std::uint64_t index, std::vector<std::uint32_t>& out) {
  const JsonValue primitives = mesh.require("primitives");
  std::string name = mesh.name();
  if (name.empty()) name = fmt::format("mesh {}", index);
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    if (!has_triangles(primitives[i], context_)) continue;
    Mesh read;
    read.name = primitives.size() == 1 ? name : fmt::format("{}/{}", name, i);
    read_primitive(mesh, primitives[i], read);
    if (read.triangles.empty()) continue;
    out.push_back(static_cast<std::uint32_t>(meshes_.size()));
    context_.budget.charge(sizeof(Mesh), primitives[i]);
    meshes_.push_back(std::move(read));
  }
}

void Meshes::read_primitive(const JsonValue& mesh, const JsonValue& primitive, Mesh& out) {
  out.material = materials_.use(primitive.find("material"));
  read_geometry(mesh, primitive, wanted_by(materials_[out.material]), context_, buffers_, out);
  if (has_transparent_vertex(out)) materials_.note_vertex_alpha(out.material);
}

}  // namespace lightcuts::gltf
