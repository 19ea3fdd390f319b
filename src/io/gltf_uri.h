#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/gltf_json.h"

namespace lightcuts::gltf {

using Bytes = std::vector<std::byte>;

/// The whole of a regular file; `name` says in messages what is missing. Pipes and devices could block or never end.
/// Throws Error{file_missing} if it cannot be opened or is no regular file.
Bytes read_regular_file(const std::filesystem::path& path, const std::string& name);

/// The bytes that a `uri` member stands for: those of a data URI, or of a file below `folder`.
///
/// Throws Error{malformed} for a broken data URI, Error{unsupported} for other schemes and for files outside the
/// folder (never opened), Error{file_missing}.
Bytes read_uri(const JsonValue& uri, const std::filesystem::path& folder);

/// What to call a URI in messages: the file's name, or "embedded".
std::string uri_name(const std::string& uri);

}  // namespace lightcuts::gltf
