#pragma once

#include <stdexcept>
#include <string>

namespace lightcuts {

/// What went wrong, in the terms a caller can act on. The command maps these to exit statuses.
enum class Code {
  invalid_argument,  ///< an option or a value passed to the library is out of its range
  file_missing,      ///< a file that was named, or that another file refers to, cannot be opened
  malformed,         ///< a file's content contradicts its format
  unsupported,       ///< a file requires something this library does not implement
  invalid_scene,     ///< a scene holds values that cannot be rendered (NaN, index out of range, ...)
  no_emitter,        ///< nothing in the scene emits light
  out_of_memory,     ///< a plan does not fit the memory budget, or an allocation failed
  cannot_write,      ///< an output path cannot be written
  disk_full,         ///< writing failed half way: no space left
  no_device,         ///< the requested device does not exist or does not answer
  not_built,         ///< a backend or feature is not part of this build
};

/// The only exception the library throws on purpose.
///
/// `what()` is a whole sentence for a person: which file, where in it, what was expected, what to do.
class Error : public std::runtime_error {
 public:
  Error(Code code, const std::string& message) : std::runtime_error(message), code_(code) {}
  [[nodiscard]] Code code() const noexcept { return code_; }

 private:
  Code code_;
};

}  // namespace lightcuts
