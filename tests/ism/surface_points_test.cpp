#include "cpu/ism/surface_points.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "backend/hard_edges.h"
#include "cpu_core/scene_parts.h"
#include "ism/map_scene.h"
#include "scene/builtin/surface.h"

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

TEST(HardEdges, KnowsClosedBodiesThatFaceOut) {
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  Mesh two = test::box({0, 0, 0}, {1, 1, 1}, material);
  const Mesh open = test::quad({3, 0, 0}, {1, 0, 0}, {0, 1, 0}, material);
  const auto first = static_cast<std::uint32_t>(two.positions.size());
  two.positions.insert(two.positions.end(), open.positions.begin(), open.positions.end());
  for (const auto& t : open.triangles) two.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  two.normals.clear();
  for (auto& texcoords : two.texcoords) texcoords.clear();
  Mesh turned = test::box({0, 0, 0}, {1, 1, 1}, material);
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  test::place(scene, two);
  test::place(scene, test::box({0, 0, 0}, {1, 1, 1}, material, true));
  test::place(scene, turned);
  const MapScene s(std::move(scene));
  const auto solid = [&](std::uint32_t mesh) {
    int n = 0;
    for (const std::uint8_t bits : hard_edges(s.cpu_scene.view().meshes[mesh]).hard) n += (bits & kSolid) != 0 ? 1 : 0;
    return n;
  };
  EXPECT_EQ(solid(0), 12) << "the box, not the sheet beside it";
  EXPECT_EQ(solid(1), 0) << "a room";
  EXPECT_EQ(solid(2), 0) << "one face looks the other way";
}

TEST(HardEdges, WhereFacesDisagreeWhatIsInFrontEdgesAreHardFromBothSides) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};  // both run along their common edge the same way
  Scene scene;
  test::add_material(scene, {1, 1, 1});
  test::place(scene, mesh);
  const MapScene s(std::move(scene));
  const MeshEdges edges = hard_edges(s.cpu_scene.view().meshes[0]);
  for (const std::uint8_t bits : edges.hard) EXPECT_EQ(bits & 0b001'001, 0b001'001);
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
  EXPECT_EQ(edges.hard[0], 0b1'011'011);
  EXPECT_EQ(edges.hard[1], 0b1'110'110);
  EXPECT_EQ(edges.next[0][2], 1u);
  EXPECT_EQ(edges.next[1][0], 0u);
}

/// A body of some centimetres on a floor of 100 square metres, and the outermost place of its discs from a light on
/// its side: `depth(q)` is how far within the body a place lies [m]. A flat disc would stand out by up to 9 cm.
template <class Depth>
void expect_discs_within(const Mesh& body, const Depth& depth) {
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  test::place(scene, test::quad({-5, -5, -9}, {10, 0, 0}, {0, 10, 0}, material));
  Mesh mesh = body;
  mesh.material = material;
  test::place(scene, mesh);
  const MapScene s(std::move(scene));
  const SurfacePoints points(s.cpu_scene.view(), {8000});
  const PointArrays& a = points.arrays();
  ASSERT_GT(a.shapes[0].radius, 0.1f);
  // From wherever the light comes.
  for (const float* sink : {a.sink_in_front, a.sink_behind}) {
    int checked = 0, outside = 0;
    float farthest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (a.z[i] < -8) continue;
      const DiscShape& shape = a.shapes[a.shape[i]];
      const Vec3 n = points.normal(i), centre = points.position(i) + n * sink[i];
      const Frame frame = make_frame(n);
      for (int k = 0; k < 128; ++k) {
        const float angle = 0.39269908f * static_cast<float>(k),
                    far = shape.radius * static_cast<float>(k / 16 + 1) / 8;
        const Vec3 q = centre + (frame.x * std::cos(angle) + frame.y * std::sin(angle)) * far;
        bool cut = false;
        for (int e = 0; e < kDiscEdges; ++e) cut = cut || dot(shape.inward[e], q) < shape.offset[e];
        if (cut) continue;
        ++checked;
        outside += depth(q) < -0.004f ? 1 : 0;
        farthest = max_of(farthest, -depth(q));
      }
    }
    ASSERT_GT(checked, 1000) << "something is left of the discs";
    EXPECT_LE(outside, checked / 40);
    EXPECT_LE(farthest, 0.03f);
  }
}

TEST(DiscShapes, StayWithinABall) {
  Mesh ball;
  add_ball(ball, {0, 0, 0}, 0.06f, 32);
  expect_discs_within(ball, [](Vec3 q) { return 0.06f - length(q); });
}

TEST(DiscShapes, StayWithinASlenderLeg) {
  Mesh leg;
  add_lathe(leg, {{0, -0.4f}, {0.02f, -0.4f}, {0.02f, 0.4f}, {0, 0.4f}}, 16, {0, 0, 0});
  expect_discs_within(leg,
                      [](Vec3 q) { return min_of(0.02f - std::sqrt(q.x * q.x + q.z * q.z), 0.4f - std::abs(q.y)); });
}

TEST(DiscShapes, StayWithinARoundedBoard) {
  Mesh board;
  const Vec3 half{0.2f, 0.02f, 0.15f};
  add_rounded_box(board, {-half, half}, 0.018f, 4);
  expect_discs_within(board, [&](Vec3 q) {
    return min_of(half.x - std::abs(q.x), min_of(half.y - std::abs(q.y), half.z - std::abs(q.z)));
  });
}

TEST(DiscShapes, StayWithinATableTopThatIsThinnerThanItsEdgeIsWide) {
  Mesh top;
  add_lathe(top, {{0, 0}, {0.56f, 0}, {0.60f, 0.01f}, {0.615f, 0.022f}, {0.60f, 0.035f}, {0, 0.035f}}, 72, {});
  expect_discs_within(
      top, [](Vec3 q) { return min_of(0.615f - std::sqrt(q.x * q.x + q.z * q.z), min_of(q.y, 0.035f - q.y)); });
}

TEST(DiscShapes, OfASheetLieBehindItFromEitherSide) {
  // A bent sheet and the same points of a closed ball's front.
  Mesh half;
  add_patch(half, 24, 12,
            [](float u, float v) {
              return Vec3{0.06f * std::cos(kPi * u), 0.3f * v, 0.06f * std::sin(kPi * u)};
            },
            {1, 1});
  Scene scene;
  const auto material = test::add_material(scene, {1, 1, 1});
  test::place(scene, test::quad({-5, -5, -9}, {10, 0, 0}, {0, 10, 0}, material));
  half.material = material;
  test::place(scene, half);
  const MapScene s(std::move(scene));
  const SurfacePoints points(s.cpu_scene.view(), {8000});
  const PointArrays& a = points.arrays();
  int bent = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (a.z[i] < -8 || a.shape[i] < 2) continue;
    const Vec3 out{a.x[i], 0, a.z[i]};
    const bool faces_out = dot(out, points.normal(i)) > 0;
    // Seen from outside it falls away, seen from inside it rises.
    const float outside = faces_out ? -a.sink_in_front[i] : a.sink_behind[i];
    const float inside = faces_out ? a.sink_behind[i] : -a.sink_in_front[i];
    EXPECT_GE(outside, 0);
    EXPECT_NEAR(inside, 0, 1e-4f);
    bent += outside > 0.0005f ? 1 : 0;
  }
  EXPECT_GT(bent, 20);
}

}  // namespace
}  // namespace lightcuts
