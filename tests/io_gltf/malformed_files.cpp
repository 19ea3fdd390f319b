// The malformed files: each loads or is refused as its list says, and nothing else happens.

#include <gtest/gtest.h>

#include "corpus.h"
#include "support/damage.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;
using testing::files_below;
using testing::shared_scenes;
using testing::try_load;

TEST(MalformedFiles, HostileScenesLoadOrAreRefusedAsListed) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  std::size_t seen = 0;
  for (const auto& [file, expectation] : test::hostile_expectations()) {
    if (!file.starts_with("gltf/") && !file.starts_with("glb/")) continue;
    SCOPED_TRACE(file + ": " + expectation);
    const auto outcome = try_load(test::hostile_files() / file);
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

TEST(MalformedFiles, AllLoadOrThrowAnErrorInLittleTimeAndMemory) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  for (const fs::path& path : files_below(shared_scenes() / "malformed", {".gltf", ".glb"})) {
    SCOPED_TRACE(path.string());
    const test::ModestReading reading;
    const auto outcome = try_load(path);
    testing::show(path, outcome);
  }
}

}  // namespace
}  // namespace lightcuts
