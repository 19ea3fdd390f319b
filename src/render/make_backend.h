#pragma once

#include <memory>

#include "backend/backend.h"

namespace lightcuts {

/// The backend that the options ask for.
/// Throws Error{not_built} for one that this build lacks, Error{no_device} if it does not answer.
std::unique_ptr<Backend> make_backend(const RenderOptions& options);

}  // namespace lightcuts
