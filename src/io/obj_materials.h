#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/obj_parse.h"
#include "lightcuts/scene.h"

namespace lightcuts::obj {

/// Adds one material for each of `data.material_names`, in that order, and the pictures they need, to the scene.
/// What is missing or damaged becomes grey, or goes without its texture, with a warning.
void add_materials(const Data& data, const std::filesystem::path& folder, Scene& scene,
                   std::vector<std::string>& warnings);

}  // namespace lightcuts::obj
