#include <gtest/gtest.h>

#include "lightcuts/error.h"
#include "lightcuts/scene.h"

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
}

}  // namespace
}  // namespace lightcuts
