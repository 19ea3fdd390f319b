#include "kernels/occluder.h"

#include <gtest/gtest.h>

#include <random>

namespace lightcuts {
namespace {

using Vec3d = Vec3T<double>;

Vec3d wide(Vec3 v) { return {v.x, v.y, v.z}; }

class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  float between(float a, float b) { return std::uniform_real_distribution<float>(a, b)(engine_); }
  Vec3 in_box(float half) { return {between(-half, half), between(-half, half), between(-half, half)}; }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = in_box(1);
      if (length_sq(v) > 0.01f && length_sq(v) <= 1) return normalize(v);
    }
  }
  Box box(Vec3 middle, float half) {
    const Vec3 size{between(0, half), between(0, half), between(0, half)};
    return {middle - size, middle + size};
  }
  Vec3 inside(const Box& b) { return {between(b.lo.x, b.hi.x), between(b.lo.y, b.hi.y), between(b.lo.z, b.hi.z)}; }

 private:
  std::mt19937 engine_;
};

/// A convex quadrilateral or triangle in any plane: corners on an ellipse.
Occluder random_occluder(Dice& dice, bool triangle) {
  Occluder o{};
  o.normal = dice.direction();
  const Vec3 u = normalize(cross(o.normal, dice.direction())), v = cross(o.normal, u);
  const Vec3 middle = dice.in_box(0.3f);
  const float width = dice.between(0.5f, 2), height = dice.between(0.5f, 2);
  const int count = triangle ? 3 : 4;
  Vec3 corners[4];
  for (int i = 0; i < count; ++i) {
    const float angle = 2 * kPi * (static_cast<float>(i) + dice.between(0.1f, 0.9f)) / static_cast<float>(count);
    corners[i] = middle + u * (width * std::cos(angle)) + v * (height * std::sin(angle));
  }
  for (int i = 0; i < 4; ++i) o.corner[i] = corners[i < count ? i : count - 1];
  for (int i = 0; i < 4; ++i) {
    const int at = i < count ? i : count - 1;
    o.inward[i] = normalize(cross(o.normal, corners[(at + 1) % count] - corners[at]));
  }
  o.area = 1;
  return o;
}

/// How far inside the polygon the line from a to b crosses it [m], negative: outside, or no crossing between them.
double depth_of_crossing(const Occluder& o, Vec3d a, Vec3d b) {
  const Vec3d n = wide(o.normal), at = wide(o.corner[0]);
  const double x = dot(n, a - at), y = dot(n, b - at);
  if (x * y >= 0) return -1;
  const Vec3d p = a + (b - a) * (x / (x - y));
  double depth = 1e30;
  for (int i = 0; i < kOccluderCorners; ++i) depth = std::min(depth, dot(wide(o.inward[i]), p - wide(o.corner[i])));
  return depth;
}

double least_depth(const Occluder& o, const Box& from, const Box& to) {
  double depth = 1e30;
  for (int i = 0; i < 8; ++i) {
    for (int k = 0; k < 8; ++k) {
      depth = std::min(depth, depth_of_crossing(o, wide(detail::box_corner(from, i)), wide(detail::box_corner(to, k))));
    }
  }
  return depth;
}

constexpr float kRounding = 1e-5f;

// Both ways: what is said to be hidden is, for every line between the boxes; and whatever is hidden with something to spare
// is found.
TEST(Occluder, ItsUmbraIsWhereEveryLineCrossesIt) {
  Dice dice(1);
  int hidden = 0, open = 0;
  for (int turn = 0; turn < 40'000; ++turn) {
    const Occluder o = random_occluder(dice, turn % 2 == 0);
    const Box receivers = dice.box(dice.in_box(2), 0.3f);
    const Box lights = dice.box(center(receivers) * -dice.between(0.2f, 1.5f) + dice.in_box(0.5f), 0.3f);
    Umbra umbra;
    const bool found = find_umbra(o, receivers, kRounding, kRounding, umbra) && hides_box(umbra, lights);
    const double depth = least_depth(o, receivers, lights);
    if (found) {
      ++hidden;
      EXPECT_GT(depth, 0) << turn;
      EXPECT_TRUE(touches_box(umbra, lights));
      EXPECT_TRUE(is_between(o, receivers, lights, kRounding));
      for (int i = 0; i < 20; ++i) {
        EXPECT_GT(depth_of_crossing(o, wide(dice.inside(receivers)), wide(dice.inside(lights))), 0) << turn;
      }
    } else {
      ++open;
      EXPECT_LT(depth, 0.01) << turn;
    }
  }
  EXPECT_GT(hidden, 1000);
  EXPECT_GT(open, 1000);
}

TEST(Occluder, DirectionsAreHiddenAsVeryFarLights) {
  Dice dice(2);
  int hidden = 0;
  for (int turn = 0; turn < 40'000; ++turn) {
    const Occluder o = random_occluder(dice, turn % 2 == 0);
    const Box receivers = dice.box(o.normal * dice.between(0.1f, 1) + dice.in_box(0.2f), 0.2f);
    const Vec3 towards = normalize(normalize(dice.in_box(0.2f) - center(receivers)) + dice.in_box(0.3f));
    const Box directions = dice.box(towards, 0.1f);
    Umbra umbra;
    if (!find_umbra(o, receivers, kRounding, kRounding, umbra) || !hides_directions(umbra, directions)) continue;
    ++hidden;
    for (int i = 0; i < 20; ++i) {
      const Vec3d from = wide(dice.inside(receivers));
      EXPECT_GT(depth_of_crossing(o, from, from + wide(dice.inside(directions)) * 1e4), 0) << turn;
    }
  }
  EXPECT_GT(hidden, 300);
}

TEST(Occluder, WhatTouchesThePlaneHasNoUmbra) {
  Dice dice(3);
  const Occluder o = random_occluder(dice, false);
  Umbra umbra;
  const Vec3 beside = o.corner[0];
  EXPECT_FALSE(find_umbra(o, {beside - Vec3{0.1f, 0.1f, 0.1f}, beside + Vec3{0.1f, 0.1f, 0.1f}}, kRounding, 0, umbra));
  EXPECT_FALSE(find_umbra(o, {beside, beside}, kRounding, 0, umbra));
}

// A light just behind a wall is not called hidden: its ray may end before the wall.
TEST(Occluder, KeepsAGap) {
  Occluder o{
      {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {1, 0, 0}}, {0, 0, 1}, 4};
  const Vec3 eye{0, 0, 1};
  Umbra umbra;
  ASSERT_TRUE(find_umbra(o, {eye, eye}, 1e-6f, 1e-3f, umbra));
  EXPECT_FALSE(hides_box(umbra, {{0, 0, -0.0009f}, {0, 0, -0.0009f}}));
  EXPECT_TRUE(hides_box(umbra, {{0, 0, -0.0011f}, {0, 0, -0.0011f}}));
  // At distance 1 behind, the umbra of a point is twice as wide as the polygon.
  EXPECT_TRUE(hides_box(umbra, {{-1.99f, -1.99f, -1}, {1.99f, 1.99f, -1}}));
  EXPECT_FALSE(hides_box(umbra, {{-1.99f, -1.99f, -1}, {2.01f, 1.99f, -1}}));
}

}  // namespace
}  // namespace lightcuts
