#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <unordered_map>

#include "io/gltf_context.h"
#include "io/gltf_uri.h"

namespace lightcuts::gltf {

/// A buffer view that is known to lie inside its buffer.
struct View {
  std::span<const std::byte> bytes;
  std::size_t stride = 0;  ///< from element to element [bytes], 0: packed
};

/// The buffers and buffer views of a file, each read or decompressed when it is first used.
class Buffers {
 public:
  /// `binary`: the chunk of a .glb that buffer 0 means if it has no uri; must outlive this.
  Buffers(Context& context, std::optional<std::span<const std::byte>> binary)
      : context_(context), binary_(binary), views_(context.array("bufferViews")), buffers_(context.array("buffers")) {}

  /// The view whose index is `reference`. Throws Error{malformed, unsupported, file_missing}.
  View view(const JsonValue& reference);

 private:
  std::span<const std::byte> buffer(const JsonValue& reference);
  std::span<const std::byte> slice(const JsonValue& place);
  std::span<const std::byte> load(const JsonValue& buffer, std::uint64_t index);
  const Bytes& decompressed(const JsonValue& view, const JsonValue& compression, std::uint64_t index);

  Context& context_;
  std::optional<std::span<const std::byte>> binary_;
  JsonValue views_;
  JsonValue buffers_;
  std::unordered_map<std::uint64_t, Bytes> loaded_;        ///< by index of the buffer
  std::unordered_map<std::uint64_t, Bytes> decompressed_;  ///< by index of the view
};

}  // namespace lightcuts::gltf
