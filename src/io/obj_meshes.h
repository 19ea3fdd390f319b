#pragma once

#include "io/obj_parse.h"
#include "lightcuts/scene.h"

namespace lightcuts::obj {

/// Turns each part into a mesh with an instance of it, computing the normals that smoothing groups ask for.
/// Uses up the parts of `data`, so that a large file is not held twice.
void add_meshes(Data& data, Scene& scene);

}  // namespace lightcuts::obj
