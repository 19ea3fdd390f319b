#pragma once

#include <string>

#include "lightcuts/render.h"
#include "render_request.h"

namespace lightcuts::app {

/// The text of `--stats`: one JSON object. The names are a contract with scripts.
std::string stats_json(const RenderRequest& request, const Statistics& statistics);

}  // namespace lightcuts::app
