#include <gtest/gtest.h>

#include <map>

#include "io/obj.h"
#include "lightcuts/error.h"
#include "support/damage.h"
#include "support/shared_scenes.h"
#include "support/temporary_folder.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  bool loads = false;
  std::size_t triangles = 0;
  std::vector<std::string> warnings;
  Scene scene;
};

/// Opens a file that may be damaged: anything but a valid scene or an Error for bad input fails the test.
Outcome load(const fs::path& path) {
  SCOPED_TRACE(path);
  const test::ModestReading reading;
  Outcome outcome;
  try {
    LoadedScene loaded = load_obj(path);
    for (std::string& sentence : validate(loaded.scene)) loaded.warnings.push_back(std::move(sentence));
    outcome.loads = true;
    outcome.triangles = static_cast<std::size_t>(drawn_triangle_count(loaded.scene));
    outcome.warnings = std::move(loaded.warnings);
    outcome.scene = std::move(loaded.scene);
  } catch (const Error& e) {
    EXPECT_TRUE(e.code() == Code::malformed || e.code() == Code::unsupported || e.code() == Code::invalid_scene)
        << e.what();
  }
  return outcome;
}

/// Holds an outcome against a line of the list: what it says, and what follows from it.
void expect_as_listed(const Outcome& outcome, const std::string& expected) {
  if (expected.find("LOADS") != std::string::npos && expected.find("REJECT") == std::string::npos) {
    EXPECT_TRUE(outcome.loads);
  }
  const std::map<std::string, std::size_t> triangles{
      {"LOADS: 2 triangles", 2}, {"LOADS: 1 triangle", 1}, {"drop face", 0}, {"REJECT or an empty scene", 0}};
  const auto count = triangles.find(expected);
  if (count != triangles.end()) {
    EXPECT_EQ(outcome.triangles, count->second);
  }
}

TEST(MalformedObj, HostileFilesGetTheExpectedAnswer) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  int count = 0;
  for (const auto& [file, expected] : test::hostile_expectations()) {
    if (!file.ends_with(".obj")) continue;
    SCOPED_TRACE(expected);
    ++count;
    const Outcome outcome = load(test::hostile_files() / file);
    expect_as_listed(outcome, expected);
    EXPECT_TRUE(outcome.scene.images.empty());
  }
  EXPECT_GE(count, 28);
}

TEST(MalformedObj, FilesOfOtherProjects) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  const fs::path folder = test::shared_scenes() / "malformed";
  EXPECT_FALSE(load(folder / "assimp/empty.obj").loads);
  for (const char* name :
       {"assimp/malformed.obj", "assimp/malformed2.obj", "tinyobjloader/issue-319-002.obj",
        "tinyobjloader/invalid-relative-texture-index.obj", "tinyobjloader/invalid-face-definition.obj"}) {
    load(folder / name);
  }
  EXPECT_TRUE(load(folder / "tinyobjloader/missing_material_file.obj").loads);
  EXPECT_TRUE(load(folder / "tinyobjloader/test-nan.obj").loads);
}

/// Flips bits, cuts, inserts numbers and repeats pieces, by turns.
std::string mutate(std::string text, int i, test::Damage& damage) {
  const std::string whole = text;
  if (i % 4 == 0) return text.substr(0, damage.below(text.size()));
  damage.flip_bits(text, text.size());
  if (i % 8 == 1) text.insert(damage.below(text.size()), std::to_string(damage.below(1 << 24)));
  if (i % 8 == 3) text.insert(damage.below(text.size()), whole.substr(0, damage.below(whole.size())));
  return text;
}

TEST(MutatedObj, FlippedAndCutFilesLoadOrAreRefused) {
  const TemporaryFolder folder;
  const std::map<std::string, std::string> good{
      {"scene.obj",
       "mtllib scene.mtl\no a\nusemtl x\ns 1\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 1 0.5 0\nv 0.5 0.4 1e-1\nvt 0 0\n"
       "vt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1 5//1 4/2\nf -1 -2 -3\ng b c\nusemtl y\ns off\nf 1 2 3 4\n"
       "f 1/1 3/2 4/1\n"},
      {"scene.mtl",
       "newmtl x\nKd 0.5 0.25 1\nKe 10 5 1\nd 0.25\nmap_Kd -s 2 2 -o 0.5 0 1 -clamp on t.png\nmap_Ke t.png\n"
       "newmtl y\nKd 1 0 0\nTr 0.75\nmap_d t.png\nPr 0.5\nPm 1\n"}};
  save_png(folder / "t.png", {2, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9}});
  for (const auto& [name, text] : good) write_whole(folder / name, text);
  const Outcome whole = load(folder / "scene.obj");
  ASSERT_TRUE(whole.loads);
  ASSERT_EQ(whole.triangles, 7u);
  ASSERT_EQ(whole.scene.images.size(), 2u);

  for (const auto& [name, text] : good) {
    test::Damage damage;
    int different = 0;
    for (int i = 0; i < 100; ++i) {
      write_whole(folder / name, mutate(text, i, damage));
      const Outcome outcome = load(folder / "scene.obj");
      different += outcome.triangles != whole.triangles || outcome.warnings != whole.warnings ? 1 : 0;
    }
    EXPECT_GE(different, 20) << name;
    write_whole(folder / name, text);
  }
}

}  // namespace
}  // namespace lightcuts
