#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace lightcuts {

/// All bytes of a file. Throws Error{file_missing} if it cannot be opened or is a folder, Error{unsupported} if it is
/// larger than `max_bytes`.
std::vector<std::byte> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

}  // namespace lightcuts
