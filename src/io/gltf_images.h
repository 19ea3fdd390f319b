#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "io/gltf_buffers.h"
#include "lightcuts/scene.h"

namespace lightcuts::gltf {

/// The pictures that materials use: each one is read and decoded once, several at a time.
class Images {
 public:
  Images(Context& context, Buffers& buffers) : context_(context), buffers_(buffers) {}

  /// Number of the picture that a texture shows, to be an index into Scene::images; kNone, with a warning, if this
  /// picture cannot be had. Decoding waits until `decode`.
  std::uint32_t use(const JsonValue& texture);

  /// Decodes all. Pictures that prove broken are left out with a warning: `materials` then lose their reference.
  std::vector<TextureImage> decode(std::vector<Material>& materials);

 private:
  struct Source {
    JsonValue where;
    std::string name;
    Bytes owned;                       ///< of a uri
    std::span<const std::byte> bytes;  ///< of the buffer view, or `owned`
    std::size_t decoded_bytes = 0;     ///< that its texels will take
  };
  Source open(const JsonValue& image);
  void warn(const JsonValue& where, const std::string& why);

  Context& context_;
  Buffers& buffers_;
  std::size_t missing_ = 0;  ///< pictures that could not be had
  std::vector<Source> sources_;
  std::map<std::string, std::uint32_t> numbers_;  ///< by what identifies the bytes
};

}  // namespace lightcuts::gltf
