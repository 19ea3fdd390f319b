#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "support/shared_scenes.h"

namespace lightcuts::testing {

using test::files_below;
using test::shared_scenes;

/// What became of a file: a scene or an Error. Any other exception fails the test that calls this.
struct Outcome {
  std::optional<LoadedScene> loaded;
  Code code = Code::malformed;
  std::string message;
};

inline Outcome try_load(const std::filesystem::path& path) {
  Outcome outcome;
  try {
    outcome.loaded = load_scene(path);
  } catch (const Error& error) {
    outcome.code = error.code();
    outcome.message = error.what();
  }
  return outcome;
}

/// Prints what became of a file, for a person who looks over the messages: LC_SHOW_OUTCOMES=1.
inline void show(const std::filesystem::path& path, const Outcome& outcome) {
  if (std::getenv("LC_SHOW_OUTCOMES") == nullptr) return;
  std::cout << (outcome.loaded ? "LOADS   " : "REFUSED ") << path.string() << "\n    " << outcome.message << "\n";
  if (!outcome.loaded) return;
  for (const std::string& warning : outcome.loaded->warnings) std::cout << "    " << warning << "\n";
}

}  // namespace lightcuts::testing
