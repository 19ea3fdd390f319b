#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "io/gltf_images.h"
#include "lightcuts/scene.h"

namespace lightcuts::gltf {

/// The materials that meshes use, each read once.
class Materials {
 public:
  Materials(Context& context, Images& images) : context_(context), images_(images) {}

  /// Index into Scene::materials of the material whose index is `reference`, or of glTF's default one if absent.
  std::uint32_t use(const JsonValue& reference);

  [[nodiscard]] const Material& operator[](std::uint32_t index) const { return materials_[index]; }
  /// Tells that some mesh has vertex colours whose alpha is below 1 (it matters for blended materials).
  void note_vertex_alpha(std::uint32_t index) { blended_[index].by_vertex = true; }

  /// All materials, once meshes and images are read. `images` are those that the texture references count.
  std::vector<Material> take() { return std::move(materials_); }
  /// Turns blended materials into masks where their alpha varies, opaque ones otherwise; says so once.
  void settle_blending(std::vector<Material>& materials, const std::vector<TextureImage>& images);

 private:
  struct Blending {
    bool wanted = false;     ///< alphaMode is BLEND
    bool by_vertex = false;  ///< vertex colours are partly transparent
  };
  Material read(const JsonValue& material);
  void read_reflection(const JsonValue& material, Material& out);
  void read_emission(const JsonValue& material, Material& out);
  void read_alpha(const JsonValue& material, Material& out);
  TextureRef read_texture(const JsonValue& info);
  void warn_ignored(const JsonValue& material, const Material& out);

  Context& context_;
  Images& images_;
  std::vector<Material> materials_;
  std::vector<Blending> blended_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
  std::uint32_t default_ = kNone;
};

}  // namespace lightcuts::gltf
