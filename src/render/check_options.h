#pragma once

#include "lightcuts/render.h"

namespace lightcuts {

/// Throws Error{invalid_argument} that says which option is out of its range, what was given and what is possible.
void check_options(const RenderOptions& options);

/// Throws Error{invalid_argument} where no rays can leave the camera.
void check_camera(const Camera& camera);

}  // namespace lightcuts
