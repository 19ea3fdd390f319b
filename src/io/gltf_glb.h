#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/gltf_context.h"

namespace lightcuts::gltf {

/// The two parts of a .glb file, as views into its bytes.
struct Container {
  std::string_view json;
  std::optional<std::span<const std::byte>> binary;  ///< what buffer 0 means if it has no uri
};

/// True if the bytes begin as a .glb does.
bool is_glb(std::span<const std::byte> file);

/// Splits a .glb file. Throws Error{malformed, unsupported}.
Container split_glb(std::span<const std::byte> file, const std::string& name, Warnings& warnings);

}  // namespace lightcuts::gltf
