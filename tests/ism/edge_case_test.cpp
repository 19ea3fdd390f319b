#include <gtest/gtest.h>

#include "cpu_core/scene_parts.h"
#include "cpu_shade/rooms.h"
#include "ism/map_scene.h"

namespace lightcuts {
namespace {

Lights one_vpl(Vec3 position, Vec3 axis) {
  Lights lights;
  lights.vpls.push_back({position, axis, {1, 1, 1}});
  return lights;
}

/// How many of `count` points of a rectangle a light reaches.
int reached(const Maps& maps, LightKind kind, Vec3 corner, Vec3 a, Vec3 b, Vec3 normal, int side) {
  int lit = 0;
  for (int i = 0; i < side * side; ++i) {
    const float u = (static_cast<float>(i % side) + 0.5f) / static_cast<float>(side);
    const float v = (static_cast<float>(i / side) + 0.5f) / static_cast<float>(side);
    lit += maps.share(kind, 0, corner + a * u + b * v + normal * 1e-5f, normal) > 0.5f ? 1 : 0;
  }
  return lit;
}

TEST(ShadowMapEdgeCases, AVplInACornerLightsAnEmptyRoom) {
  MapScene s(closed_room({0.5f, 0.5f, 0.5f}));
  for (const int size : {16, 32, 64, 128}) {
    for (const float off : {0.02f, 0.1f}) {
      s.set(one_vpl({-1, -1 + off, -1 + off}, {1, 0, 0}));
      const Maps maps(s, 4000, {size}, every_light(s.light_set));
      // Where walls meet, a texel of the other wall may darken half a texel's width.
      const int most = 400 - 1600 / size;
      EXPECT_GE(reached(maps, LightKind::vpl, {-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, {0, 1, 0}, 20), most) << size << off;
      EXPECT_GE(reached(maps, LightKind::vpl, {1, -1, -1}, {0, 0, 2}, {0, 2, 0}, {-1, 0, 0}, 20), most) << size << off;
      EXPECT_GE(reached(maps, LightKind::vpl, {-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, {0, -1, 0}, 20), most) << size << off;
    }
  }
}

TEST(ShadowMapEdgeCases, AVplOnAThinWallSeesItsOwnSideAndIsHiddenByOthers) {
  Scene scene = closed_room({0.5f, 0.5f, 0.5f});
  add_rectangle(scene, {0, -1, -1}, {0, 2, 0}, {0, 0, 2}, 0);  // two walls, 2 cm apart
  add_rectangle(scene, {0.02f, -1, -1}, {0, 2, 0}, {0, 0, 2}, 0);
  MapScene s(std::move(scene));
  s.set(one_vpl({0.02f, 0, 0}, {1, 0, 0}));
  const Maps right(s, 8000, {}, every_light(s.light_set));
  EXPECT_EQ(reached(right, LightKind::vpl, {1, -1, -1}, {0, 0, 2}, {0, 2, 0}, {-1, 0, 0}, 20), 400);
  s.set(one_vpl({0, 0, 0}, {1, 0, 0}));  // between the walls
  const Maps between(s, 8000, {}, every_light(s.light_set));
  EXPECT_LE(reached(between, LightKind::vpl, {1, -1, -1}, {0, 0, 2}, {0, 2, 0}, {-1, 0, 0}, 20), 20);
}

TEST(ShadowMapEdgeCases, ALightOutsideTheSceneSeesItsSilhouette) {
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  test::place(scene, test::quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, material));
  test::place(scene, test::quad({-0.5f, -0.5f, 1}, {1, 0, 0}, {0, 1, 0}, material));
  MapScene s(std::move(scene));
  s.set(one_vpl({0, 0, 10}, {0, 0, -1}));
  const Maps maps(s, 8000, {256}, every_light(s.light_set));
  EXPECT_LE(reached(maps, LightKind::vpl, {-0.4f, -0.4f, 0}, {0.8f, 0, 0}, {0, 0.8f, 0}, {0, 0, 1}, 20), 20);
  EXPECT_EQ(maps.share(LightKind::vpl, 0, {0, 0, 1.0001f}, {0, 0, 1}), 1);
  EXPECT_EQ(maps.share(LightKind::vpl, 0, {-0.9f, 0.9f, 1e-4f}, {0, 0, 1}), 1);
}

TEST(ShadowMapEdgeCases, OneTriangleIsEnoughAndNoneToo) {
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  Mesh mesh;
  mesh.positions = {{-2, -2, 0}, {2, -2, 0}, {0, 3, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.material = material;
  test::place(scene, mesh);
  MapScene s(scene);
  s.set(one_vpl({0, 0, 1}, {0, 0, -1}));
  const Maps maps(s, 1000, {}, every_light(s.light_set));
  EXPECT_EQ(maps.share(LightKind::vpl, 0, {0, 0, -1}, {0, 0, 1}), 0);
  EXPECT_EQ(maps.share(LightKind::vpl, 0, {0, 0, 1e-5f}, {0, 0, 1}), 1);
  EXPECT_EQ(maps.share(LightKind::vpl, 0, {6, 6, -1}, {0, 0, 1}), 1);

  scene.instances.clear();
  MapScene empty(scene);
  empty.set(one_vpl({0, 0, 1}, {0, 0, -1}));
  const Maps none(empty, 1000, {}, every_light(empty.light_set));
  EXPECT_EQ(none.share(LightKind::vpl, 0, {0, 0, -1}, {0, 0, 1}), 1);
}

TEST(ShadowMapEdgeCases, ALightThatSeesNothingLightsWhatItReaches) {
  Scene scene;
  test::place(scene, test::quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, test::add_material(scene, {1, 1, 1})));
  MapScene s(std::move(scene));
  s.set(one_vpl({0, 0, 0}, {0, 0, 1}));  // looks away from all there is
  const Maps maps(s, 1000, {}, every_light(s.light_set));
  for (const std::uint32_t code : maps.set.codes_of(LightKind::vpl, 0)) ASSERT_EQ(code, 0xffffu);
  EXPECT_EQ(maps.share(LightKind::vpl, 0, {0.3f, 0, 1}, {0, 0, -1}), 1);
}

TEST(ShadowMapEdgeCases, HugeAndTinyTrianglesTogether) {
  // A floor of 100 m, and a disc of 20 000 tiny triangles, none of which could hold a point of its own.
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  test::place(scene, test::quad({-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, material));
  Mesh tiny;
  tiny.material = material;
  constexpr std::uint32_t side = 100;
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      tiny.positions.push_back({-6 + 0.12f * static_cast<float>(x), -6 + 0.12f * static_cast<float>(y), 2});
    }
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t i = y * (side + 1) + x;
      tiny.triangles.push_back({i, i + 1, i + side + 2});
      tiny.triangles.push_back({i, i + side + 2, i + side + 1});
    }
  }
  test::place(scene, tiny);
  MapScene s(std::move(scene));
  s.set(one_vpl({0, 0, 5}, {0, 0, -1}));
  const Maps maps(s, 8000, {}, every_light(s.light_set));
  EXPECT_LE(reached(maps, LightKind::vpl, {-8, -8, 0}, {16, 0, 0}, {0, 16, 0}, {0, 0, 1}, 20), 12);
  EXPECT_GE(reached(maps, LightKind::vpl, {-6, -6, 2}, {12, 0, 0}, {0, 12, 0}, {0, 0, 1}, 20), 398);
  EXPECT_GE(reached(maps, LightKind::vpl, {20, -8, 0}, {16, 0, 0}, {0, 16, 0}, {0, 0, 1}, 20), 398);
}

TEST(ShadowMapEdgeCases, APointLightSeesBothHemispheres) {
  Scene scene = closed_room({0.5f, 0.5f, 0.5f});
  add_rectangle(scene, {-0.3f, -0.3f, 0.5f}, {0.6f, 0, 0}, {0, 0.6f, 0}, 0);
  MapScene s(std::move(scene));
  Lights lights;
  PointLight light;
  light.position = {0, 0, 0};
  light.axis = normalize(Vec3{0.3f, 1, 0.2f});
  lights.points.push_back(light);
  s.set(lights);
  const Maps maps(s, 8000, {}, every_light(s.light_set));
  EXPECT_EQ(maps.set.map_count(), 2u);
  EXPECT_LE(reached(maps, LightKind::point, {-0.5f, -0.5f, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, 20), 20);
  // In a corner a texel of another wall may darken one.
  EXPECT_GE(reached(maps, LightKind::point, {-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, {0, 1, 0}, 20), 398);
  EXPECT_GE(reached(maps, LightKind::point, {-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, {0, -1, 0}, 20), 398);
  EXPECT_GE(reached(maps, LightKind::point, {-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, {1, 0, 0}, 20), 398);
  EXPECT_GE(reached(maps, LightKind::point, {-1, -1, -1}, {0, 2, 0}, {2, 0, 0}, {0, 0, 1}, 20), 398);
}

TEST(ShadowMapEdgeCases, TheSunShinesThroughAWindow) {
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  test::place(scene, test::quad({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, material));
  test::place(scene, test::quad({-2, -2, 2}, {2, 0, 0}, {0, 4, 0}, material));
  MapScene s(std::move(scene));
  Lights lights;
  lights.directionals.push_back({normalize(Vec3{0, 0.1f, -1}), {1, 1, 1}});
  s.set(lights);
  const Maps maps(s, 8000, {}, every_light(s.light_set));
  EXPECT_LE(reached(maps, LightKind::directional, {-1.9f, -1.6f, 0}, {1.8f, 0, 0}, {0, 3.4f, 0}, {0, 0, 1}, 20), 8);
  EXPECT_GE(reached(maps, LightKind::directional, {0.1f, -1.9f, 0}, {1.8f, 0, 0}, {0, 3.8f, 0}, {0, 0, 1}, 20), 392);
  EXPECT_EQ(reached(maps, LightKind::directional, {-1.9f, -1.9f, 2}, {1.8f, 0, 0}, {0, 3.8f, 0}, {0, 0, 1}, 20), 400);
}

}  // namespace
}  // namespace lightcuts
