#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "command.h"

namespace lightcuts::test {
namespace {

using testing::HasSubstr;

TEST(Scenes, ListsWhatCanBeOpened) {
  const ProgramResult r = run_lightcuts({"scenes", "--json"});
  ASSERT_EQ(r.status, 0) << r.err;
  std::vector<std::string> names;
  for (const auto& scene : nlohmann::json::parse(r.out)) {
    names.push_back(scene.at("name"));
    EXPECT_EQ(run_lightcuts({"info", "builtin:" + names.back()}).status, 0) << names.back();
    EXPECT_THAT(run_lightcuts({"scenes"}).out, HasSubstr("builtin:" + names.back()));
  }
  for (const char* name : {"cornell", "furnace", "lamps", "study"}) EXPECT_THAT(names, testing::Contains(name));
}

TEST(Info, JsonOfABuiltinScene) {
  const ProgramResult r = run_lightcuts({"info", "builtin:cornell", "--json"});
  ASSERT_EQ(r.status, 0) << r.err;
  const auto json = nlohmann::json::parse(r.out);
  EXPECT_GT(json.at("triangles").get<int>(), 10);
  EXPECT_GT(json.at("emitters").at("triangles").get<int>(), 0);
  EXPECT_TRUE(json.at("emits_light").get<bool>());
  EXPECT_GE(json.at("cameras").size(), 1u);
  EXPECT_GT(json.at("memory_bytes").get<int>(), 0);
  EXPECT_EQ(json.at("bounds").at("lo").size(), 3u);
  for (const char* key : {"meshes", "instances", "materials", "textures", "lights", "size", "warnings"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
}

TEST(Info, FilesThatCannotBeUsedAreThree) {
  const TemporaryFolder folder;
  std::ofstream(folder / "broken.gltf") << "{ \"asset\": ";
  std::ofstream(folder / "empty.glb");
  for (const char* name : {"broken.gltf", "empty.glb", "missing.obj"}) {
    const ProgramResult r = run_lightcuts({"info", (folder / name).string()});
    EXPECT_EQ(r.status, 3) << name;
    EXPECT_THAT(r.err, HasSubstr(name));
  }
}

TEST(Info, WrongKeyOfABuiltinSceneIsTwo) {
  EXPECT_EQ(run_lightcuts({"info", "builtin:lamps?cuont=3"}).status, 2);
  EXPECT_EQ(run_lightcuts({"info", "builtin:lamps?count=-3"}).status, 2);
}

}  // namespace
}  // namespace lightcuts::test
