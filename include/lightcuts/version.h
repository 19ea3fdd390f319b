#pragma once

#include <string_view>

namespace lightcuts {

/// The library's version, such as "0.1.0".
std::string_view version() noexcept;

/// The commit it was built from, with "-dirty" behind it if files were changed; "unknown" outside a git repository.
std::string_view commit() noexcept;

/// Whether the CUDA backend was compiled in; whether a device answers is another question.
bool built_with_cuda() noexcept;

}  // namespace lightcuts
