#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "io/gltf_accessors.h"
#include "io/gltf_materials.h"
#include "lightcuts/scene.h"

namespace lightcuts::gltf {

/// The meshes that nodes place, each read once: one Mesh for each of its primitives that has triangles.
class Meshes {
 public:
  Meshes(Context& context, Buffers& buffers, Materials& materials)
      : context_(context), buffers_(buffers), materials_(materials) {}

  /// Indices into Scene::meshes of the primitives of the glTF mesh whose index is `reference`.
  const std::vector<std::uint32_t>& use(const JsonValue& reference);

  std::vector<Mesh> take() { return std::move(meshes_); }

 private:
  void read_mesh(const JsonValue& mesh, std::uint64_t index, std::vector<std::uint32_t>& out);
  void read_primitive(const JsonValue& mesh, const JsonValue& primitive, Mesh& out);

  Context& context_;
  Buffers& buffers_;
  Materials& materials_;
  std::vector<Mesh> meshes_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> primitives_;  ///< by index of the glTF mesh
};

}  // namespace lightcuts::gltf
