#pragma once

#include <filesystem>
#include <string>

namespace lightcuts {

/// The ending of a file's name with its dot, ASCII letters in lower case: ".exr".
std::string lower_case_ending(const std::filesystem::path& path);

}  // namespace lightcuts
