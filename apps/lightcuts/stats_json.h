#pragma once

#include <cstdint>
#include <string>

#include "lightcuts/render.h"
#include "render_request.h"

namespace lightcuts::app {

/// The text of `--stats`: one JSON object. The names are a contract with scripts.
std::string stats_json(const RenderRequest& request, const Statistics& statistics);

/// Most memory that this process has had in use so far [bytes].
std::uint64_t peak_memory_bytes();

}  // namespace lightcuts::app
