#include "cpu/ism/surface_points.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "backend/hard_edges.h"
#include "cpu_core/scene_parts.h"
#include "ism/map_scene.h"

namespace lightcuts {
namespace {

TEST(SurfacePoints, EveryBlockCoversEveryTriangleByItsArea) {
  // A huge rectangle, a small one, and an instance of the small one at five times its size.
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  test::place(scene, test::quad({0, 0, 0}, {10, 0, 0}, {0, 10, 0}, material));
  const auto small = test::place(scene, test::quad({0, 0, 5}, {1, 0, 0}, {0, 1, 0}, material));
  scene.instances.push_back({"", small, {{5, 0, 0}, {0, 5, 0}, {0, 0, 1}, {0, 0, 5}}});
  const MapScene s(std::move(scene));
  const SurfacePoints points(s.cpu_scene.view(), {1000});
  ASSERT_EQ(points.size(), SurfacePoints::count_for({1000}));
  EXPECT_NEAR(points.area(), 126, 1e-3);
  for (const std::size_t start : {0u, 777u, 4096u, 60000u}) {
    double count[3] = {};
    for (std::size_t i = start; i < start + 2520; ++i) {
      const float z = points.position(i).z;
      ++count[z < 1 ? 0 : z < 7 ? 1 : 2];
      ASSERT_GE(points.position(i).x, -1e-4);
      ASSERT_LE(points.position(i).y, 10.001);
      ASSERT_NEAR(std::abs(points.normal(i).z), 1, 1e-6);
    }
    EXPECT_NEAR(count[0], 2000, 6);
    EXPECT_NEAR(count[1], 20, 4);
    EXPECT_NEAR(count[2], 500, 6);
  }
}

TEST(SurfacePoints, BlocksLeaveNoLargeGapOnASquare) {
  Scene scene;
  test::place(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, test::add_material(scene, {1, 1, 1})));
  const MapScene s(std::move(scene));
  const SurfacePoints points(s.cpu_scene.view(), {1024});
  // Random points would leave exp(-4), one cell of 55, empty.
  int empty = 0;
  for (const std::size_t start : {0u, 300u, 5000u, 31111u}) {
    bool hit[16][16] = {};
    for (std::size_t i = start; i < start + 1024; ++i) {
      hit[std::min(15, static_cast<int>(points.position(i).x * 16))]
         [std::min(15, static_cast<int>(points.position(i).y * 16))] = true;
    }
    for (const auto& row : hit) {
      for (const bool h : row) empty += h ? 0 : 1;
    }
  }
  EXPECT_LE(empty, 2);
}

TEST(SurfacePoints, AnAlphaMaskHasNoPoints) {
  Scene scene;
  Material leaf;
  leaf.alpha_mode = AlphaMode::mask;
  scene.images.push_back({"half", 2, 1, 4, {255, 255, 255, 255, 255, 255, 255, 0}});
  leaf.base_color_texture.image = 0;
  leaf.base_color_texture.nearest = true;
  scene.materials.push_back(leaf);
  test::place(scene, test::quad({0, 0, 0}, {2, 0, 0}, {0, 1, 0}, 0));
  const MapScene s(scene);
  const SurfacePoints points(s.cpu_scene.view(), {100});
  ASSERT_EQ(points.size(), SurfacePoints::count_for({100}));
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_LE(points.position(i).x, 1.001f);

  scene.images[0].texels = {255, 255, 255, 0, 255, 255, 255, 0};
  const MapScene nothing(scene);
  EXPECT_EQ(SurfacePoints(nothing.cpu_scene.view(), {100}).size(), 0u) << "and it comes to an end";
}

TEST(SurfacePoints, DoNotDependOnThreads) {
  const MapScene s(make_builtin_scene("cornell"));
  const SurfacePoints many(s.cpu_scene.view(), {500});
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const SurfacePoints alone(s.cpu_scene.view(), {500});
  ASSERT_EQ(many.size(), alone.size());
  for (std::size_t i = 0; i < many.size(); ++i) ASSERT_TRUE(many.position(i) == alone.position(i));
}

TEST(HardEdges, ABoxesEdgesAreHardOutsideAndHollowInside) {
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  test::place(scene, test::box({0, 0, 0}, {1, 1, 1}, material));
  test::place(scene, test::box({0, 0, 0}, {1, 1, 1}, material, true));
  const MapScene s(std::move(scene));
  const auto count = [](const std::vector<std::uint8_t>& bits, unsigned mask) {
    int n = 0;
    for (const std::uint8_t b : bits) n += __builtin_popcount(b & mask);
    return n;
  };
  const auto outside = hard_edges(s.cpu_scene.view().meshes[0]).hard;
  const auto inside = hard_edges(s.cpu_scene.view().meshes[1]).hard;
  // Two triangles a face: two edges each are the box's, the diagonal is smooth.
  EXPECT_EQ(count(outside, 7), 24);
  EXPECT_EQ(count(outside, 56), 0);
  EXPECT_EQ(count(inside, 7), 0);
  EXPECT_EQ(count(inside, 56), 24);
}

TEST(HardEdges, OpenEdgesAreHardAndUnweldedOnesAreNot) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  Scene scene;
  test::add_material(scene, {1, 1, 1});
  test::place(scene, mesh);
  const MapScene s(std::move(scene));
  const MeshEdges edges = hard_edges(s.cpu_scene.view().meshes[0]);
  EXPECT_EQ(edges.hard[0], 0b011'011);
  EXPECT_EQ(edges.hard[1], 0b110'110);
  EXPECT_EQ(edges.flat[0][2], 1u);
  EXPECT_EQ(edges.flat[1][0], 0u);
}

}  // namespace
}  // namespace lightcuts
