#include <gtest/gtest.h>

#include "cut/cut_scene.h"
#include "oracle/cut_oracle.h"

namespace lightcuts::test {
namespace {

void expect_promise(const CutScene& scene, const CutNodes& nodes, const CheckedPoint& point, double error) {
  EXPECT_TRUE(holds_each_light_once(scene.trees.vpls, nodes[0]));
  EXPECT_TRUE(holds_each_light_once(scene.trees.points, nodes[1]));
  EXPECT_TRUE(holds_each_light_once(scene.trees.directionals, nodes[2]));
  const DoubleCheck check = check_again(scene.lights, scene.trees, nodes, point);
  EXPECT_LE(check.largest, error * check.total);
  EXPECT_LE(std::abs(check.total - check.exact), check.bound_sum + 1e-5 * check.exact);
}

TEST(HeapCut, KeepsItsPromise) {
  Dice dice(3);
  for (const float error : {0.1f, 0.02f, 0.003f}) {
    const CutScene scene(mixed_lights(1, 700, 150, 90), error);
    for (int i = 0; i < 12; ++i) {
      const SurfacePacket packet = random_surfaces(dice);
      const PixelCut cut = heap_cut_of(scene, packet, i);
      const CheckedPoint point = point_of(packet, i, scene);
      expect_promise(scene, nodes_of(cut), point, error);
      const DoubleCheck check = check_again(scene.lights, scene.trees, nodes_of(cut), point);
      EXPECT_NEAR(cut.total, check.total, 1e-5 * check.total);
      EXPECT_NEAR(cut.largest_bound, check.largest, 1e-4 * check.largest);
    }
  }
}

TEST(HeapCut, RefinesWhatTheTextbookRefines) {
  Dice dice(4);
  const CutScene scene(mixed_lights(2, 1000, 0, 0));
  for (int i = 0; i < 20; ++i) {
    SurfacePacket packet = random_surfaces(dice, true);
    for (int lane = 0; lane < kPacketSize; ++lane) set_lane(packet.albedo, lane, {0.5f, 0.5f, 0.5f});
    const PixelCut cut = heap_cut_of(scene, packet, 5);
    const CheckedPoint p = point_of(packet, 5, scene);
    const oracle::CutResult textbook = oracle::heap_cut(
        scene.trees.vpls, scene.lights.vpls, {p.position, p.ns, 0.5, p.min_distance}, 0.02 * (1 - kThresholdSlack));
    std::vector<std::uint32_t> ours = nodes_of(cut)[0], theirs = textbook.nodes;
    std::sort(ours.begin(), ours.end());
    std::sort(theirs.begin(), theirs.end());
    // Rounding may decide otherwise about a node or two.
    std::vector<std::uint32_t> differ;
    std::set_symmetric_difference(ours.begin(), ours.end(), theirs.begin(), theirs.end(), std::back_inserter(differ));
    EXPECT_LE(differ.size(), 6u);
    EXPECT_NEAR(cut.total / kPi, textbook.total, 1e-3 * textbook.total);
  }
}

TEST(HeapCut, WithoutErrorItIsTheSumOverAllLights) {
  Dice dice(5);
  const CutScene scene(mixed_lights(3, 400, 60, 40), 0);
  for (int i = 0; i < 8; ++i) {
    const SurfacePacket packet = random_surfaces(dice);
    const PixelCut cut = heap_cut_of(scene, packet, i);
    const DoubleCheck check = check_again(scene.lights, scene.trees, nodes_of(cut), point_of(packet, i, scene));
    EXPECT_NEAR(cut.total, check.exact, 1e-5 * check.exact);
  }
}

TEST(HeapCut, ARefinementCostsOneEvaluation) {
  Dice dice(6);
  const CutScene scene(mixed_lights(4, 800, 100, 50));
  const SurfacePacket packet = random_surfaces(dice);
  PixelLights lights(scene.context, packet, 2);
  PixelCut cut;
  cut_by_heap(scene.context, lights, cut);
  EXPECT_EQ(lights.evaluations(), cut.nodes.size());
}

TEST(HeapCut, StopsAtTheLargestCut) {
  Dice dice(7);
  const SurfacePacket packet = random_surfaces(dice);
  for (const std::uint32_t most : {1u, 3u, 4u, 50u}) {
    const CutScene scene(mixed_lights(4, 800, 100, 50), 0.001f, most);
    const PixelCut cut = heap_cut_of(scene, packet, 2);
    EXPECT_EQ(cut.nodes.size(), std::max(most, 3u));  // never below the roots
    EXPECT_TRUE(holds_each_light_once(scene.trees.vpls, nodes_of(cut)[0]));
  }
}

TEST(HeapCut, TheTotalStaysAccurateWhereItShrinksByManyOrders) {
  // The representative of the root is a thousand million times as bright as what remains once it is split off.
  Lights lights;
  for (int i = 0; i < 200; ++i) {
    const float x = 0.01f * static_cast<float>(i);
    lights.vpls.push_back({{x, 1, 0}, {0, -1, 0}, {1e-6f, 1e-6f, 1e-6f}});
  }
  lights.vpls.push_back({{0, -1, 0}, {0, -1, 0}, {1e12f, 1e12f, 1e12f}});  // below the floor, shines away
  const CutScene scene(lights);
  SurfacePacket packet{};
  packet.receivers.active = 1;
  set_lane(packet.receivers.ns, 0, {0, 1, 0});
  set_lane(packet.receivers.ng, 0, {0, 1, 0});
  set_lane(packet.albedo, 0, {1, 1, 1});
  expect_promise(scene, nodes_of(heap_cut_of(scene, packet, 0)), point_of(packet, 0, scene), 0.02);
}

}  // namespace
}  // namespace lightcuts::test
