#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lightcuts/error.h"
#include "make.h"

namespace lightcuts {
namespace {

TEST(LookAt, LooksAlongMinusZWithYUp) {
  const Camera camera = look_at({1, 2, 3}, {1, 2, -7}, 0.5f);
  EXPECT_EQ(camera.world_from_camera.x, (Vec3{1, 0, 0}));
  EXPECT_EQ(camera.world_from_camera.y, (Vec3{0, 1, 0}));
  EXPECT_EQ(camera.world_from_camera.z, (Vec3{0, 0, 1}));
  EXPECT_EQ(camera.world_from_camera.origin, (Vec3{1, 2, 3}));
  EXPECT_FLOAT_EQ(camera.vertical_fov_rad, 0.5f);
}

TEST(LookAt, IsOrthonormalAndRightHandedInEveryDirection) {
  for (const Vec3 target : {Vec3{3, 1, -2}, Vec3{0, 5, 0}, Vec3{0, -5, 0}, Vec3{-1, 100, 1e-3f}, Vec3{1e-4f, 0, 0}}) {
    const Affine m = look_at({0, 0, 0}, target, 1).world_from_camera;
    EXPECT_NEAR(determinant(m), 1, 1e-5);
    EXPECT_NEAR(dot(m.x, m.y), 0, 1e-5);
    EXPECT_NEAR(dot(m.y, m.z), 0, 1e-5);
    EXPECT_NEAR(dot(m.z, normalize(target)), -1, 1e-5);
    EXPECT_GE(m.y.y, 0);
  }
}

TEST(LookAt, RefusesWhatHasNoView) {
  EXPECT_THROW(look_at({1, 1, 1}, {1, 1, 1}, 1), Error);
  EXPECT_THROW(look_at({1, 1, 1}, {1, 1, 2}, 0), Error);
  EXPECT_THROW(look_at({1, 1, 1}, {1, 1, 2}, kPi), Error);
  EXPECT_THROW(look_at({1, 1, 1}, {1, std::numeric_limits<float>::quiet_NaN(), 2}, 1), Error);
  EXPECT_THROW(look_at({1e30f, 1, 1}, {1, 1, 2}, 1), Error);
  EXPECT_THROW(look_at({1, 1, 1}, {1, -1e13f, 2}, 1), Error);
}

// ---- select_camera

Scene three_cameras() {
  Scene scene = test::square_scene();
  scene.cameras.resize(3);
  scene.cameras[0].name = "front";
  scene.cameras[1].name = "2";
  scene.cameras[2].name = "back door";
  return scene;
}

TEST(SelectCamera, ByNameThenByNumber) {
  const Scene scene = three_cameras();
  EXPECT_EQ(select_camera(scene, "").name, "front");
  EXPECT_EQ(select_camera(scene, "back door").name, "back door");
  EXPECT_EQ(select_camera(scene, "0").name, "front");
  EXPECT_EQ(select_camera(scene, "2").name, "2") << "a name comes before a number";
}

TEST(SelectCamera, ListsWhatThereIs) {
  for (const char* wrong : {"3", "-1", "Front", "0x1", "1.0", "99999999999999999999999"}) {
    try {
      select_camera(three_cameras(), wrong);
      ADD_FAILURE() << wrong;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::invalid_argument);
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr(wrong), testing::HasSubstr("\"back door\"")));
    }
  }
  EXPECT_THROW(select_camera(test::square_scene(), "0"), Error);
}

/// Every corner of the box lies within a square picture of this camera.
void expect_in_view(const Camera& camera, Box box) {
  const Affine m = camera.world_from_camera;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = Vec3{(corner & 1) != 0 ? box.hi.x : box.lo.x, (corner & 2) != 0 ? box.hi.y : box.lo.y,
                        (corner & 4) != 0 ? box.hi.z : box.lo.z} -
                   m.origin;
    const float depth = -dot(p, m.z), limit = depth * std::tan(camera.vertical_fov_rad / 2) * 1.0001f;
    EXPECT_GT(depth, 0);
    EXPECT_LE(std::fabs(dot(p, m.x)), limit);
    EXPECT_LE(std::fabs(dot(p, m.y)), limit);
  }
}

TEST(SelectCamera, FramesAnObjectFromOutside) {
  for (const float scale : {1e-3f, 1.0f, 1e5f}) {
    Scene scene = test::square_scene();
    scene.instances[0].world_from_object = {{scale, 0, 0}, {0, scale, 0}, {0, 0, scale}, {7 * scale, 0, 0}};
    expect_in_view(select_camera(scene, ""), scene_bounds(scene));
  }
}

TEST(SelectCamera, StandsInsideARoomButOutsideABox) {
  for (const char* name : {"furnace", "study", "cornell"}) {
    SCOPED_TRACE(name);
    Scene scene = make_builtin_scene(name);
    scene.cameras.clear();
    const Box box = scene_bounds(scene);
    const Vec3 eye = select_camera(scene, "").world_from_camera.origin;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(component(eye, axis), component(box.lo, axis));
      EXPECT_LT(component(eye, axis), component(box.hi, axis));
    }
    for (Mesh& mesh : scene.meshes) {
      for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
    }
    expect_in_view(select_camera(scene, ""), box);
  }
}

TEST(SelectCamera, ManagesWithoutGeometry) { EXPECT_NO_THROW(select_camera(Scene{}, "")); }

}  // namespace
}  // namespace lightcuts
