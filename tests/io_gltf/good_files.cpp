// Every glTF file of the collection opens and draws as many triangles as its list says.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "corpus.h"
#include "io/gltf.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;
using testing::files_below;
using testing::shared_scenes;

/// The README's tables: folder name -> triangles drawn.
std::map<std::string, std::uint64_t> listed_triangles() {
  std::map<std::string, std::uint64_t> listed;
  std::ifstream readme(shared_scenes() / "README.md");
  for (std::string line; std::getline(readme, line);) {
    std::istringstream cells(line);
    std::string empty, name, files, count;
    std::getline(cells, empty, '|');
    std::getline(cells, name, '|');
    std::getline(cells, files, '|');
    std::getline(cells, count, '|');
    std::erase(name, ' ');
    std::erase(count, ',');
    std::istringstream number(count);
    std::uint64_t triangles = 0;
    if (number >> triangles) listed[name] = triangles;
  }
  return listed;
}

TEST(GoodFiles, OpenWithTheListedTriangles) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  const auto listed = listed_triangles();
  std::map<std::string, std::uint64_t> largest;
  std::size_t opened = 0;
  for (const char* kind : {"gltf", "rooms"}) {
    for (const fs::path& path : files_below(shared_scenes() / kind, {".gltf", ".glb"})) {
      SCOPED_TRACE(path.string());
      if (path.filename() == "ACMEBox.gltf") continue;  // its required extension does not exist: see below
      const std::string folder = path.parent_path().filename().string();
      LoadedScene loaded;
      ASSERT_NO_THROW(loaded = load_gltf(path));
      ++opened;
      auto& most = largest[folder];
      most = std::max(most, drawn_triangle_count(loaded.scene));
      EXPECT_NO_THROW(validate(loaded.scene));
    }
  }
  EXPECT_GE(opened, 84u);
  for (const auto& [folder, triangles] : largest) {
    ASSERT_TRUE(listed.contains(folder)) << folder;
    // The list counts a file without scenes as empty; here all its root nodes are drawn.
    if (folder == "bio-00_no_scenes") continue;
    EXPECT_EQ(triangles, listed.at(folder)) << folder;
  }
}

TEST(GoodFiles, UnknownRequiredExtensionIsRefusedByName) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  const auto outcome = testing::try_load(shared_scenes() / "gltf/ACMEBox/ACMEBox.gltf");
  ASSERT_FALSE(outcome.loaded.has_value());
  EXPECT_EQ(outcome.code, Code::unsupported);
  EXPECT_NE(outcome.message.find("ACME_gizmo"), std::string::npos) << outcome.message;
  EXPECT_NE(outcome.message.find("extensionsRequired[0]"), std::string::npos) << outcome.message;
}

}  // namespace
}  // namespace lightcuts
