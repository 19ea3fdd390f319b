#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

// The collected scenes beside the checkout (../shared/scenes); tests of them are skipped where they are absent.

namespace lightcuts::test {

inline std::filesystem::path shared_scenes() { return LC_SHARED_SCENES; }

#define LC_SKIP_WITHOUT_SHARED_SCENES()                                 \
  if (!std::filesystem::is_directory(lightcuts::test::shared_scenes())) \
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

inline std::filesystem::path hostile_files() { return shared_scenes() / "malformed/own-hostile"; }

/// What its list expects of each of the hostile files, by their path below hostile_files().
inline std::map<std::string, std::string> hostile_expectations() {
  std::map<std::string, std::string> expected;
  std::ifstream list(hostile_files() / "EXPECTED.tsv");
  for (std::string line; std::getline(list, line);) {
    std::istringstream cells(line);
    std::string file, bytes, text;
    std::getline(cells, file, '\t');
    std::getline(cells, bytes, '\t');
    std::getline(cells, text);
    expected[file] = text;
  }
  return expected;
}

}  // namespace lightcuts::test
