// The node tree and what hangs on it: transforms, instances, cameras, lights, scenes.

#include <gtest/gtest.h>

#include "gltf_builder.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

using testing::GltfBuilder;
using testing::json;
using testing::make_square;
using testing::warns;

GltfBuilder with_nodes(const char* nodes) {
  GltfBuilder square = make_square();
  square.root["nodes"] = json::parse(nodes);
  return square;
}

void expect_refused(const GltfBuilder& builder, Code code, const std::string& part) {
  try {
    builder.load();
    ADD_FAILURE() << "expected an Error about " << part;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

void expect_near(Vec3 a, Vec3 b) { EXPECT_LT(length(a - b), 1e-5f) << "(" << a.x << ", " << a.y << ", " << a.z << ")"; }

TEST(Nodes, TransformsCompose) {
  // A quarter turn about z, twice the size, under a matrix that moves by (10, 0, 0).
  const Scene scene = with_nodes(R"([{"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 10,0,0,1], "children": [1]},
      {"mesh": 0, "rotation": [0, 0, 0.70710678, 0.70710678], "scale": [2, 2, 2], "translation": [0, 1, 0]}])")
                          .load()
                          .scene;
  ASSERT_EQ(scene.instances.size(), 1u);
  expect_near(transform_point(scene.instances[0].world_from_object, {1, 0, 0}), {10, 3, 0});
  expect_near(transform_point(scene.instances[0].world_from_object, {0, 1, 0}), {8, 1, 0});
}

TEST(Nodes, MeshesAreNotCopied) {
  GltfBuilder square = with_nodes(R"([{"mesh": 0, "children": [1]}, {"mesh": 0, "translation": [1, 0, 0]}])");
  square.root["meshes"][0]["primitives"].push_back(square.primitive());
  const Scene scene = square.load().scene;
  EXPECT_EQ(scene.meshes.size(), 2u) << "one for each primitive";
  EXPECT_EQ(scene.instances.size(), 4u);
  EXPECT_EQ(drawn_triangle_count(scene), 8u);
}

TEST(Nodes, InstancingExtension) {
  GltfBuilder square = make_square();
  const std::size_t moves =
      square.add_accessor(square.add_values(std::vector<float>{1, 0, 0, 2, 0, 0, 3, 0, 0}), 5126, "VEC3", 3);
  square.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = moves;
  const Scene scene = square.load().scene;
  ASSERT_EQ(scene.instances.size(), 3u);
  expect_near(scene.instances[2].world_from_object.origin, {3, 0, 0});
}

TEST(Nodes, OnlyTheDefaultSceneIsRead) {
  GltfBuilder square = with_nodes(R"([{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}])");
  square.root["scenes"] = json::parse(R"([{"nodes": [0]}, {"nodes": [1], "name": "second"}])");
  square.root["scene"] = 1;
  LoadedScene loaded = square.load();
  ASSERT_EQ(loaded.scene.instances.size(), 1u);
  EXPECT_EQ(loaded.scene.instances[0].world_from_object.origin.x, 5);
  EXPECT_EQ(loaded.scene.name, "second");
  EXPECT_TRUE(warns(loaded, "2 scenes"));
  square.root.erase("scene");
  EXPECT_EQ(square.load().scene.instances[0].world_from_object.origin.x, 0);
  square.root.erase("scenes");
  EXPECT_EQ(square.load().scene.instances.size(), 2u) << "no scenes: all root nodes";
}

TEST(Nodes, CyclesAndSharedChildrenAreRefused) {
  expect_refused(with_nodes(R"([{"children": [1]}, {"children": [2]}, {"children": [1]}])"), Code::malformed,
                 "nodes[2].children[0]");
  expect_refused(with_nodes(R"([{"children": [1]}, {"children": [0]}])"), Code::malformed, "own ancestor");
  expect_refused(with_nodes(R"([{}, {"children": [1]}])"), Code::malformed, "nodes[1]");
}

TEST(Nodes, DepthIsNotLimited) {
  GltfBuilder chain = make_square();
  constexpr int kDepth = 100000;
  chain.root["nodes"] = json::array();
  for (int i = 1; i < kDepth; ++i) chain.root["nodes"].push_back({{"children", {i}}, {"translation", {1, 0, 0}}});
  chain.root["nodes"].push_back({{"mesh", 0}});
  EXPECT_EQ(chain.load().scene.instances[0].world_from_object.origin.x, kDepth - 1);
}

TEST(Nodes, HiddenNodesHideTheirChildren) {
  const Scene scene = with_nodes(R"([{"children": [1], "extensions": {"KHR_node_visibility": {"visible": false}}},
                                     {"mesh": 0}])")
                          .load()
                          .scene;
  EXPECT_TRUE(scene.instances.empty());
}

TEST(Nodes, Cameras) {
  GltfBuilder square = with_nodes(R"([{"name": "front", "camera": 0, "translation": [0, 0, 5], "scale": [3, 3, 3]},
                                      {"camera": 1}, {"camera": 2}, {"camera": 0}])");
  square.root["scenes"][0]["nodes"] = {0, 1, 2, 3};
  square.root["cameras"] = json::parse(R"([
      {"type": "perspective", "perspective": {"yfov": 0.5, "aspectRatio": 1.5, "znear": 0.1}},
      {"type": "orthographic", "name": "plan", "orthographic": {"xmag": 4, "ymag": 2, "znear": 0, "zfar": 9}},
      {"type": "perspective", "perspective": {"yfov": 4, "znear": 0.1}}])");
  const LoadedScene loaded = square.load();
  ASSERT_EQ(loaded.scene.cameras.size(), 3u);
  const Camera& front = loaded.scene.cameras[0];
  EXPECT_EQ(front.name, "front");
  EXPECT_FLOAT_EQ(front.vertical_fov_rad, 0.5f);
  EXPECT_FLOAT_EQ(front.aspect, 1.5f);
  expect_near(front.world_from_camera.origin, {0, 0, 5});
  expect_near(front.world_from_camera.z, {0, 0, 1});
  EXPECT_EQ(loaded.scene.cameras[1].name, "plan");
  EXPECT_FLOAT_EQ(loaded.scene.cameras[1].orthographic_height, 4);
  EXPECT_FLOAT_EQ(loaded.scene.cameras[1].aspect, 2);
  EXPECT_TRUE(warns(loaded, "cameras[2]"));
}

TEST(Nodes, PunctualLights) {
  GltfBuilder square = with_nodes(R"([
      {"translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
      {"rotation": [0.70710678, 0, 0, 0.70710678], "extensions": {"KHR_lights_punctual": {"light": 1}}},
      {"scale": [5, 5, 5], "extensions": {"KHR_lights_punctual": {"light": 2}}}])");
  square.root["scenes"][0]["nodes"] = {0, 1, 2};
  square.root["extensions"]["KHR_lights_punctual"]["lights"] = json::parse(R"([
      {"type": "point", "color": [1, 0.5, 0], "intensity": 20, "range": 4},
      {"type": "spot", "intensity": 2, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}},
      {"type": "directional", "intensity": 3}])");
  const LoadedScene loaded = square.load();
  ASSERT_EQ(loaded.scene.point_lights.size(), 2u);
  const PointLight& point = loaded.scene.point_lights[0];
  expect_near(point.position, {1, 2, 3});
  expect_near(point.intensity, {20, 10, 0});
  EXPECT_LT(point.cos_outer, -1);
  const PointLight& spot = loaded.scene.point_lights[1];
  expect_near(spot.axis, {0, 1, 0});
  EXPECT_FLOAT_EQ(spot.cos_inner, std::cos(0.2f));
  EXPECT_FLOAT_EQ(spot.cos_outer, std::cos(0.6f));
  ASSERT_EQ(loaded.scene.directional_lights.size(), 1u);
  expect_near(loaded.scene.directional_lights[0].direction, {0, 0, -1});
  expect_near(loaded.scene.directional_lights[0].irradiance, {3, 3, 3});
  EXPECT_TRUE(warns(loaded, "range"));
}

TEST(Nodes, SkinsAndAnimationsAreNamed) {
  GltfBuilder square = with_nodes(R"([{"mesh": 0, "skin": 0, "weights": [1]}])");
  square.root["animations"] = json::array({json::object()});
  const LoadedScene loaded = square.load();
  EXPECT_TRUE(warns(loaded, "skins are not applied"));
  EXPECT_TRUE(warns(loaded, "animations are ignored"));
  EXPECT_TRUE(warns(loaded, "morph weights"));
}

TEST(Nodes, ManyWarningsOfAKindAreCounted) {
  GltfBuilder square = make_square();
  json line = square.primitive();
  line["mode"] = 1;
  square.root["meshes"][0]["primitives"] = std::vector<json>(20000, line);
  const LoadedScene loaded = square.load();
  EXPECT_EQ(loaded.warnings.size(), 1u);
  EXPECT_TRUE(warns(loaded, "19999 more"));
}

}  // namespace
}  // namespace lightcuts
