// The malformed files: each loads or is refused as its list says, and nothing else happens.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <fstream>
#include <map>
#include <sstream>

#include "corpus.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;
using testing::files_below;
using testing::shared_scenes;
using testing::try_load;

/// First word of the expectation in own-hostile/EXPECTED.tsv, by file.
std::map<std::string, std::string> hostile_expectations() {
  std::map<std::string, std::string> expected;
  std::ifstream list(shared_scenes() / "malformed/own-hostile/EXPECTED.tsv");
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

TEST(MalformedFiles, HostileScenesLoadOrAreRefusedAsListed) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  const fs::path root = shared_scenes() / "malformed/own-hostile";
  std::size_t seen = 0;
  for (const auto& [file, expectation] : hostile_expectations()) {
    if (!file.starts_with("gltf/") && !file.starts_with("glb/")) continue;
    SCOPED_TRACE(file + ": " + expectation);
    const auto outcome = try_load(root / file);
    ++seen;
    const bool may_load = expectation.find("LOADS") != std::string::npos || expectation.find("REJECT or") == 0 ||
                          expectation.find("any result") == 0;
    const bool may_refuse = expectation.find("REJECT") != std::string::npos || expectation.find("any result") == 0;
    testing::show(file, outcome);
    if (outcome.loaded) {
      EXPECT_TRUE(may_load);
    } else {
      EXPECT_TRUE(may_refuse) << outcome.message;
      EXPECT_NE(outcome.message.find(fs::path(file).filename().string()), std::string::npos) << outcome.message;
    }
  }
  EXPECT_GE(seen, 120u);
}

#ifndef __SANITIZE_ADDRESS__
/// Every malformed file in one process: at most 1 GiB for all of them, and 10 s for each.
TEST(MalformedFiles, TakeLittleTimeAndMemory) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  for (const fs::path& path : files_below(shared_scenes() / "malformed", {".gltf", ".glb"})) {
    const auto start = std::chrono::steady_clock::now();
    try_load(path);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10)) << path;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 1 << 20) << "kB";
}
#endif

TEST(MalformedFiles, OthersLoadOrThrowAnError) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  for (const fs::path& path : files_below(shared_scenes() / "malformed", {".gltf", ".glb"})) {
    if (path.string().find("own-hostile") != std::string::npos) continue;
    SCOPED_TRACE(path.string());
    const auto outcome = try_load(path);
    testing::show(path, outcome);
  }
}

}  // namespace
}  // namespace lightcuts
