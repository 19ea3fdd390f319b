#include "cpu/cut/calibration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cpu/simd/isa.h"
#include "cut/cut_scene.h"

namespace lightcuts::test {
namespace {

TEST(CutTests, GainIsOnePlusTheMeanDifferenceAsFarAsItIsCertain) {
  CutTests tests;
  EXPECT_EQ(tests.gain(), 1);
  // 100 tests of +0.01 +- 0.02, where inner nodes give half of the light.
  tests.count = 100;
  tests.difference = 1;
  tests.difference_sq = 100 * 4e-4;
  tests.inner = 50;
  const double variance = 4e-6, certain = 1e-4 / (1e-4 + variance);
  EXPECT_NEAR(tests.gain(), 1 + certain * 0.02, 1e-12);
  EXPECT_NEAR(tests.needed(0.002), 100, 1e-9);
  EXPECT_NEAR(tests.needed(0.001), 400, 1e-9);
  tests.inner = 0;
  EXPECT_EQ(tests.gain(), 1);
  for (const double absurd : {-1e30, 1e30, 1e300}) {
    tests = {absurd, absurd * absurd, 1, 1, 0, 0};
    EXPECT_GE(tests.gain(), 0.5);
    EXPECT_LE(tests.gain(), 2);
  }
}

TEST(CutTests, OnlyDifferencesFarAboveTheUsualAskForAFinerBound) {
  const auto at = [](double deviation, double error, std::uint64_t count = 100) {
    CutTests tests;
    tests.count = count;
    tests.difference_sq = static_cast<double>(count) * deviation * deviation;
    return tests.suitable_error(error, 0.02);
  };
  EXPECT_EQ(at(0.0, 0.02), 0.02);
  EXPECT_EQ(at(0.01, 0.012), 0.012);  // a coarser one is never asked for
  EXPECT_EQ(at(0.028, 0.02), 0.02);
  EXPECT_NEAR(at(0.03, 0.02), 0.02 * std::pow(0.75, 1 / 0.7), 1e-9);
  EXPECT_NEAR(at(1.0, 0.02), 0.012, 1e-9);
  EXPECT_EQ(at(1.0, 0.02, 20), 0.02);  // too few to tell
}

Tile tile_of(const SurfacePacket& packet) {
  Tile tile{};
  tile.packets[0] = packet;
  return tile;
}

double reflected(const SurfacePacket& packet, int lane, const Vec3T<double>& light) {
  const Vec3 albedo = get_lane(packet.albedo, lane);
  return luminance(Vec3T<double>{albedo.x * light.x, albedo.y * light.y, albedo.z * light.z});
}

struct TestedScene {
  CutScene scene;
  Frontier frontier;
  CutTools tools;
  CutScratch scratch;

  TestedScene(Lights lights, float error)
      : scene(std::move(lights), error),
        frontier(make_frontier(scene.context, 64)),
        tools{scene.context, frontier, cut_kernels(selected_isa()), shade_kernels(selected_isa()), kAnyGroups} {}

  TestedTile test(const Tile& tile, int most, std::uint64_t seed) {
    TestedTile out;
    test_cuts(tools, nullptr, tile, most, seed, scratch, out);
    return out;
  }
};

// On average a node lit from a light drawn afresh gives the sum over its lights: the difference is what the cut lacks.
TEST(CutTests, DifferencesAverageToTheErrorOfTheCut) {
  Dice dice(4);
  // Clumps of so few lights that six levels below each lead to single ones.
  Lights lights;
  for (int clump = 0; clump < 40; ++clump) {
    const Vec3 middle = dice.in_box(1.5f), axis = dice.direction();
    for (int i = 0; i < 10; ++i) lights.vpls.push_back({middle + dice.in_box(0.1f), axis, dice.color()});
  }
  TestedScene tested(lights, 0.08f);
  const SurfacePacket packet = random_surfaces(dice);
  const Tile tile = tile_of(packet);
  CutTests tests;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) tests.add(tested.test(tile, kTilePixels, seed).tests);
  ASSERT_EQ(tests.count, 1500u * kPacketSize);

  CutCollector collector;
  packet_cut_of(tested.scene, packet, collector, selected_isa());
  double error = 0, size = 0;
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const DoubleCheck check = check_lane(tested.scene, packet, collector, lane);
    error += (check.exact - check.total) / check.total / kPacketSize;
    size += std::abs(check.exact - check.total) / check.total / kPacketSize;
  }
  const auto n = static_cast<double>(tests.count);
  const double deviation = std::sqrt(tests.difference_sq) / n;
  EXPECT_NEAR(tests.difference / n, error, 4 * deviation);
  EXPECT_LT(4 * deviation, 0.1 * size);  // else nothing was shown
}

TEST(CutTests, SingleLightsAreNotTested) {
  Dice dice(5);
  TestedScene tested(mixed_lights(3, 40, 0, 0), 0.0f);
  const TestedTile tile = tested.test(tile_of(random_surfaces(dice)), kTilePixels, 1);
  EXPECT_EQ(tile.tests.count, static_cast<std::uint64_t>(kPacketSize));
  EXPECT_NEAR(tile.tests.difference, 0, 1e-9);
  EXPECT_EQ(tile.tests.gain(), 1);
}

// At any gain the promise holds for what the picture shows, lit with the gain or taken from a test.
TEST(CutTests, ThePromiseHoldsAtAnyGain) {
  Dice dice(6);
  int taken = 0;
  for (const double gain : {0.93, 0.99, 1.0, 1.01, 1.07}) {
    for (const float error : {0.05f, 0.01f}) {
      TestedScene tested(mixed_lights(7, 600, 100, 50), error);
      const SurfacePacket packet = coherent_surfaces(dice, 0.05f, false);
      const Tile tile = tile_of(packet);
      const TestedTile before = tested.test(tile, 4, 1);
      tested.scene.context.gain = gain;

      CutCollector collector;
      const TileLight lit = packet_cut_of(tested.scene, packet, collector, selected_isa());
      TileLight again;
      const bool takes = before.take(tested.scene.context, tile, again);
      taken += takes ? 1 : 0;
      for (int lane = 0; lane < kPacketSize; ++lane) {
        const DoubleCheck check = check_lane(tested.scene, packet, collector, lane);
        const double total = total_of(lit, packet, lane);
        EXPECT_LE(std::max(gain, 1.0) * check.largest, error * total);
        EXPECT_LE(lit.cut_bound[lane], error);
        EXPECT_GE(lit.cut_bound[lane] * total, std::max(gain, 1.0) * check.largest * (1 - 1e-5));
        if (!takes) continue;
        EXPECT_LE(again.cut_bound[lane], error);
        const double leaves = reflected(packet, lane, before.leaves[lane]);
        const double inner = reflected(packet, lane, before.light.light[lane]) - leaves;
        EXPECT_NEAR(reflected(packet, lane, again.light[lane]), leaves + gain * inner, 1e-9 * (leaves + inner));
      }
    }
  }
  EXPECT_GT(taken, 0);
}

}  // namespace
}  // namespace lightcuts::test
