#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "lightcuts/error.h"
#include "lightcuts/io.h"

namespace lightcuts::testing {

/// The collected scenes; tests of them are skipped where they are absent.
inline std::filesystem::path shared_scenes() { return LC_SHARED_SCENES; }

#define LC_SKIP_WITHOUT_SHARED_SCENES()                                    \
  if (!std::filesystem::is_directory(lightcuts::testing::shared_scenes())) \
  GTEST_SKIP() << "the test scenes (../shared/scenes) are not there"

/// All files below `folder` with one of the endings, sorted.
inline std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder,
                                                      const std::vector<std::string>& endings) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension().string();
    if (entry.is_regular_file() && std::find(endings.begin(), endings.end(), ending) != endings.end()) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

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
