#include "io/obj_triangulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>

namespace lightcuts::obj {
namespace {

Vec3 area_vector(Vec3 a, Vec3 b, Vec3 c) { return cross(b - a, c - a) * 0.5f; }

/// Newell's oriented area.
Vec3 polygon_area(const std::vector<Vec3>& corners) {
  Vec3 sum{};
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) sum += area_vector(corners[0], corners[i], corners[i + 1]);
  return sum;
}

/// Triangles that all have the polygon's orientation, and its area in sum, cover a simple polygon exactly once.
void expect_exact_cover(const std::vector<Vec3>& corners) {
  Triangulator triangulator;
  const Vec3 whole = polygon_area(corners);
  const Vec3 normal = normalize(whole);
  float sum = 0;
  for (const auto& [a, b, c] : triangulator.triangulate(corners)) {
    ASSERT_LT(std::max({a, b, c}), corners.size());
    const float area = dot(normal, area_vector(corners[a], corners[b], corners[c]));
    EXPECT_GT(area, 0) << a << ' ' << b << ' ' << c;
    sum += area;
  }
  EXPECT_NEAR(sum, length(whole), 1e-5f * length(whole));
}

/// The same polygon in several planes, from every first corner.
void expect_exact_cover_everywhere(const std::vector<Vec2>& flat) {
  for (std::size_t shift = 0; shift < flat.size(); ++shift) {
    std::vector<Vec3> xy, yz, tilted, reversed;
    for (std::size_t i = 0; i < flat.size(); ++i) {
      const Vec2 p = flat[(i + shift) % flat.size()];
      xy.push_back({p.x, p.y, 3});
      yz.push_back({-2, p.x, p.y});
      tilted.push_back({p.x + p.y, p.x - p.y, 2 * p.x});
      reversed.insert(reversed.begin(), {p.x, 7, p.y});
    }
    for (const auto& corners : {xy, yz, tilted, reversed}) expect_exact_cover(corners);
  }
}

std::vector<Vec2> star(int corners, float inner_radius) {
  std::vector<Vec2> points;
  for (int i = 0; i < corners; ++i) {
    const float angle = 2 * kPi * static_cast<float>(i) / static_cast<float>(corners);
    const float radius = i % 2 == 0 ? 1.0f : inner_radius;
    points.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return points;
}

TEST(Triangulate, Convex) {
  expect_exact_cover_everywhere({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  expect_exact_cover_everywhere(star(38, 1));
}

TEST(Triangulate, Concave) {
  expect_exact_cover_everywhere({{0, 0}, {2, -1}, {0, 3}, {-2, -1}});
  expect_exact_cover_everywhere({{0, 0}, {4, 0}, {4, 4}, {3, 4}, {3, 1}, {1, 1}, {1, 4}, {0, 4}});  // U
  expect_exact_cover_everywhere({{1, 0}, {2, 0}, {2, 2}, {3, 2}, {3, 3}, {0, 3}, {0, 2}, {1, 2}});  // T
  expect_exact_cover_everywhere(star(24, 0.2f));
  std::vector<Vec2> comb{{0, -1}, {20, -1}};
  for (int i = 20; i >= 0; --i) comb.push_back({static_cast<float>(i), i % 2 == 0 ? 0.0f : 5.0f});
  expect_exact_cover_everywhere(comb);
}

TEST(Triangulate, CornersInALineAndRepeatedCorners) {
  expect_exact_cover_everywhere({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}});
  expect_exact_cover_everywhere({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 1}, {1, 1}, {0, 2}});
  expect_exact_cover_everywhere({{0, 0}, {0, 0}, {2, 0}, {2, 2}, {2, 2}, {0, 2}});
}

TEST(Triangulate, HoleWithABridge) {
  expect_exact_cover_everywhere({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}});
}

TEST(Triangulate, FarFromTheOrigin) {
  expect_exact_cover({{4096, 4096, 512}, {4098, 4095, 512}, {4096, 4099, 512}, {4094, 4095, 512}});
}

TEST(Triangulate, WithoutAPlaneThereAreStillTriangles) {
  Triangulator triangulator;
  const std::vector<Vec3> line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  EXPECT_EQ(triangulator.triangulate(line).size(), 2u);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Vec3> bad{{0, 0, 0}, {1, 0, 0}, {nan, 0, 0}, {0, 1, 0}, {0, 2, 0}};
  EXPECT_EQ(triangulator.triangulate(bad).size(), 3u);
  const std::vector<Vec3> bow{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_FALSE(triangulator.triangulate(bow).empty());
}

TEST(Triangulate, HugePolygonsTakeBoundedTime) {
  std::vector<Vec3> corners;
  for (const Vec2 p : star(300000, 0.5f)) corners.push_back({p.x, p.y, 0});
  Triangulator triangulator;
  const std::clock_t start = std::clock();  // processor time: other programs do not count
  EXPECT_GT(triangulator.triangulate(corners).size(), 200000u);
  EXPECT_LT(std::clock() - start, 10 * CLOCKS_PER_SEC);
  EXPECT_TRUE(triangulator.gave_up());
}

}  // namespace
}  // namespace lightcuts::obj
