#pragma once

#include "io/gltf_context.h"

namespace lightcuts::gltf {

/// Checks `asset` (the version) and the lists of extensions: one that is required and unknown is refused by name, one
/// that is only used is named in a warning. Throws Error{malformed, unsupported}.
void check_requirements(Context& context);

}  // namespace lightcuts::gltf
