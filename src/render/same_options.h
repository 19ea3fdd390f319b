#pragma once

#include "lightcuts/render.h"

namespace lightcuts {

// Whether what a stage made serves for other options too. A new option of a stage belongs here.

bool same_vpls(const VplOptions& a, const VplOptions& b);
bool same_trees(const TreeOptions& a, const TreeOptions& b);
bool same_backend(const RenderOptions& a, const RenderOptions& b);

}  // namespace lightcuts
