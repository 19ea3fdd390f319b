#include <gtest/gtest.h>

#include "make.h"

namespace lightcuts {
namespace {

using test::square_scene;

TEST(EmitsLight, FollowsWhatIsDrawn) {
  Scene scene = square_scene();
  EXPECT_TRUE(emits_light(scene));
  scene.instances.clear();
  EXPECT_FALSE(emits_light(scene)) << "a mesh that nothing draws gives no light";
  scene = square_scene();
  scene.materials[0].emission = {};
  EXPECT_FALSE(emits_light(scene));
  scene.point_lights.push_back({{0, 0, 0}, {0, 0, 1}, {0, 0, -1}, -1, -2});
  EXPECT_TRUE(emits_light(scene));
}

TEST(EmitsLight, BlackTexturesAndEnvironmentsAreDark) {
  Scene scene = square_scene();
  scene.images.push_back({"black", 1, 1, 4, {0, 0, 0, 255}});
  scene.materials[0].emission_texture.image = 0;
  EXPECT_FALSE(emits_light(scene));
  scene.images[0].texels[1] = 1;
  EXPECT_TRUE(emits_light(scene));
  scene.materials[0].emission = {};
  scene.environment = Environment{{0, 0, 0}, nullptr};
  EXPECT_FALSE(emits_light(scene));
  scene.environment->radiance = {0, 1, 0};
  EXPECT_TRUE(emits_light(scene));
}

TEST(SceneBounds, FollowTheTransformsAndIgnoreUnusedPositions) {
  Scene scene = square_scene();
  scene.meshes[0].positions.push_back({100, 100, 100});
  scene.meshes[0].normals.push_back({0, 0, 1});
  scene.instances.push_back({"moved", 0, {{0, 2, 0}, {-3, 0, 0}, {0, 0, 1}, {10, 0, 5}}});
  const Box box = scene_bounds(scene);
  EXPECT_EQ(box.lo, (Vec3{0, 0, 0}));
  EXPECT_EQ(box.hi, (Vec3{10, 2, 5}));
  EXPECT_EQ(drawn_triangle_count(scene), 4u);
}

TEST(SceneBounds, EmptyWithoutInstances) {
  Scene scene = square_scene();
  scene.instances.clear();
  EXPECT_TRUE(is_empty(scene_bounds(scene)));
  EXPECT_EQ(drawn_triangle_count(scene), 0u);
}

}  // namespace
}  // namespace lightcuts
