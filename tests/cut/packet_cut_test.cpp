#include <gtest/gtest.h>

#include "cpu/simd/isa.h"
#include "cpu/tree/assemble_tree.h"
#include "cpu/tree/leaf_clusters.h"
#include "cpu/tree/merge_tree.h"
#include "cut/cut_scene.h"

namespace lightcuts::test {
namespace {

class PacketCut : public testing::TestWithParam<Isa> {};
INSTANTIATE_TEST_SUITE_P(Isa, PacketCut, testing::ValuesIn(available_isas()),
                         [](const testing::TestParamInfo<Isa>& parameter) {
                           std::string name(isa_name(parameter.param));
                           std::erase(name, '.');
                           return name;
                         });

void expect_once(const CutScene& scene, const CutNodes& nodes) {
  EXPECT_TRUE(holds_each_light_once(scene.trees.vpls, nodes[0]));
  EXPECT_TRUE(holds_each_light_once(scene.trees.points, nodes[1]));
  EXPECT_TRUE(holds_each_light_once(scene.trees.directionals, nodes[2]));
}

void expect_promise(const DoubleCheck& check, double error) {
  EXPECT_LE(check.largest, error * check.total);
  EXPECT_LE(check.worst_error, error * check.total + 1e-6 * check.exact);  // what the promise is for
  EXPECT_LE(std::abs(check.total - check.exact), check.bound_sum + 1e-5 * check.exact);
}

void expect_consistent(const CutScene& scene, const SurfacePacket& packet, const CutCollector& collector,
                       const TileLight& lit, double error) {
  for (int lane = 0; lane < kPacketSize; ++lane) {
    expect_once(scene, collector.cuts[lane]);
    const DoubleCheck check = check_lane(scene, packet, collector, lane);
    expect_promise(check, error);
    EXPECT_NEAR(total_of(lit, packet, lane), check.total, 1e-5 * check.total);
    EXPECT_GE(lit.cut_bound[lane] * check.total, check.largest * (1 - 1e-5));
    EXPECT_LE(lit.cut_bound[lane], error);
    std::size_t size = 0;
    for (const auto& nodes : collector.cuts[lane]) size += nodes.size();
    EXPECT_EQ(lit.cut_size[lane], size);
  }
}

TEST_P(PacketCut, KeepsItsPromiseWhateverTheGuess) {
  Dice dice(3);
  for (const float error : {0.1f, 0.02f, 0.003f}) {
    const CutScene scene(mixed_lights(1, 500, 100, 60), error);
    // Guesses that are right, a hundred times too high and a hundred times too low.
    for (const double scale : {1.0, 100.0, 0.01}) {
      const SurfacePacket packet = random_surfaces(dice, dice.between(0, 1) < 0.5f);
      CutCollector collector;
      const TileLight lit = packet_cut_of(scene, packet, collector, GetParam(), kAnyGroups, scale);
      expect_consistent(scene, packet, collector, lit, error);
    }
  }
}

TEST_P(PacketCut, AGuessFarTooLowDoesNotMakeItLarge) {
  Dice dice(5);
  const CutScene scene(mixed_lights(1, 20000, 0, 0));
  const SurfacePacket packet = coherent_surfaces(dice, 0.003f, true);
  CutCollector right, low;
  const TileLight expected = packet_cut_of(scene, packet, right, GetParam());
  const TileLight lit = packet_cut_of(scene, packet, low, GetParam(), kAnyGroups, 1e-4);
  expect_consistent(scene, packet, low, lit, 0.02);
  for (int lane = 0; lane < kPacketSize; ++lane) EXPECT_LT(lit.cut_size[lane], expected.cut_size[lane] + 550);
}

TEST_P(PacketCut, NoGuessIsTooLowForLightsWithoutEnd) {
  Lights lights = mixed_lights(1, 3000, 0, 0);
  for (Vpl& vpl : lights.vpls) vpl.intensity *= 1e38f;
  Dice dice(6);
  const CutScene scene(lights);
  CutCollector collector;
  const SurfacePacket packet = random_surfaces(dice);
  packet_cut_of(scene, packet, collector, GetParam(), kAnyGroups, 1e-4);
  for (int lane = 0; lane < kPacketSize; ++lane) expect_once(scene, collector.cuts[lane]);
}

TEST_P(PacketCut, KeepsItsPromiseWhateverTheGroup) {
  Dice dice(33);
  const CutScene scene(mixed_lights(1, 700, 100, 60));
  for (const GroupTuning& tuning : {kAnyGroups, kSinglePixels, GroupTuning{0.05f, 0.9f, 16, 2, 1.1f}}) {
    for (const float size : {0.0f, 1e-4f, 0.02f, 0.5f}) {
      for (const bool curved : {false, true}) {
        const SurfacePacket packet = coherent_surfaces(dice, size, curved);
        CutCollector collector;
        const TileLight lit = packet_cut_of(scene, packet, collector, GetParam(), tuning);
        expect_consistent(scene, packet, collector, lit, 0.02);
      }
    }
  }
}

TEST_P(PacketCut, IsHardlyLargerThanTheHeaps) {
  Dice dice(8);
  const CutScene scene(mixed_lights(2, 3000, 0, 0));
  double heap = 0, packet_size = 0;
  for (int i = 0; i < 6; ++i) {
    const SurfacePacket packet = coherent_surfaces(dice, 0.003f, i % 2 == 0);
    CutCollector collector;
    const TileLight lit = packet_cut_of(scene, packet, collector, GetParam());
    for (int lane = 0; lane < kPacketSize; ++lane) {
      heap += static_cast<double>(heap_cut_of(scene, packet, lane).nodes.size());
      packet_size += lit.cut_size[lane];
    }
  }
  EXPECT_LT(packet_size, 1.3 * heap);
  EXPECT_GT(packet_size, 0.9 * heap);
}

TEST_P(PacketCut, OfSinglePixelsIsTheHeapsButForTheOrder) {
  Dice dice(8);
  const CutScene scene(mixed_lights(2, 3000, 0, 0));
  double heap = 0, packet_size = 0;
  for (int i = 0; i < 6; ++i) {
    const SurfacePacket packet = random_surfaces(dice);
    CutCollector collector;
    const TileLight lit = packet_cut_of(scene, packet, collector, GetParam(), kSinglePixels);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      heap += static_cast<double>(heap_cut_of(scene, packet, lane).nodes.size());
      packet_size += lit.cut_size[lane];
    }
  }
  EXPECT_LT(packet_size, 1.2 * heap);
  EXPECT_GT(packet_size, 0.9 * heap);
}

TEST_P(PacketCut, WithoutErrorItIsTheSumOverAllLights) {
  Dice dice(5);
  const CutScene scene(mixed_lights(3, 400, 60, 40), 0);
  const SurfacePacket packet = random_surfaces(dice);
  CutCollector collector;
  const TileLight lit = packet_cut_of(scene, packet, collector, GetParam());
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const DoubleCheck check =
        check_again(scene.lights, scene.trees, collector.cuts[lane], point_of(packet, lane, scene));
    EXPECT_NEAR(total_of(lit, packet, lane), check.exact, 1e-5 * check.exact);
    EXPECT_EQ(lit.cut_bound[lane], 0);
  }
}

TEST_P(PacketCut, FitsItsLargestCutWithLittleMoreErrorThanTheHeap) {
  Dice dice(9);
  for (const std::uint32_t most : {1u, 10u, 60u, 200u}) {
    const CutScene scene(mixed_lights(4, 2000, 100, 50), 0.001f, most);
    double heap_error = 0, packet_error = 0;
    for (int i = 0; i < 4; ++i) {
      const SurfacePacket packet = coherent_surfaces(dice, 0.01f, i % 2 == 0);
      CutCollector collector;
      const TileLight lit = packet_cut_of(scene, packet, collector, GetParam());
      for (int lane = 0; lane < kPacketSize; ++lane) {
        const CheckedPoint point = point_of(packet, lane, scene);
        EXPECT_LE(lit.cut_size[lane], std::max(most, 3u));
        EXPECT_TRUE(holds_each_light_once(scene.trees.vpls, collector.cuts[lane][0]));
        const DoubleCheck check = check_again(scene.lights, scene.trees, collector.cuts[lane], point);
        const PixelCut heap = heap_cut_of(scene, packet, lane);
        packet_error += check.largest / check.exact;
        heap_error += heap.largest_bound / check.exact;
      }
    }
    EXPECT_LE(packet_error, 1.2 * heap_error) << most;
  }
}

/// A tree that is a chain: every node has a leaf and the rest.
LightTree chain_tree(const Lights& lights) {
  const LeafClusters leaves = leaf_clusters(lights.vpls, Metric::walter, 3);
  MergeTree merges;
  const auto count = static_cast<std::uint32_t>(lights.vpls.size());
  for (std::uint32_t i = 1; i < count; ++i) merges.children.push_back({i == 1 ? 0 : count + i - 2, i});
  return assemble_tree(merges, leaves.clusters, 1);
}

TEST_P(PacketCut, ItsStackIsSmallOnAChainOfAHundredThousand) {
  Lights lights;
  Dice dice(11);
  for (int i = 0; i < 100'000; ++i) lights.vpls.push_back({dice.in_box(1), dice.direction(), {1, 1, 1}});
  CutScene scene(lights, 0);
  scene.trees.vpls = chain_tree(scene.lights);
  ASSERT_EQ(scene.trees.vpls.depth, 100'000u);
  GroupWalk walk{};
  walk.nodes = scene.trees.vpls.nodes.data();
  walk.group = receiver_group<float>({{0, 0, 0}, {0, 0, 0}}, {0, 1, 0}, 1, 0, 0);
  walk.weights = {1e38f, 1e38f, 1e38f};  // accepts what is dark and leaves alone
  walk.min_distance_sq = 1e-4f;
  const WaitingNode root{0, kNone};
  walk.feed = &root;
  walk.feed_count = 1;
  ChosenNode chosen[64];
  std::uint32_t leaves = 0, deepest = 0;
  while (walk.feed_count > 0 || walk.waiting_count > 0) {
    const std::uint32_t count = cut_kernels(GetParam()).walk[0](walk, chosen, 64);
    for (std::uint32_t i = 0; i < count; ++i) leaves += scene.trees.vpls.nodes[chosen[i].node].leaf_count;
    deepest = std::max(deepest, walk.waiting_count);
  }
  EXPECT_EQ(leaves, 100'000u);
  EXPECT_LE(deepest, 1u);
}

TEST_P(PacketCut, ItsStackIsSmallOnABroadTree) {
  const CutScene scene(mixed_lights(21, 60'000, 0, 0), 0);
  GroupWalk walk{};
  walk.nodes = scene.trees.vpls.nodes.data();
  walk.group = receiver_group<float>({{-2, -2, -2}, {2, 2, 2}}, {0, 1, 0}, -1, 0, 0);
  walk.weights = {1e38f, 1e38f, 1e38f};
  walk.min_distance_sq = 1e-4f;
  const WaitingNode root{0, kNone};
  walk.feed = &root;
  walk.feed_count = 1;
  ChosenNode chosen[2 * kMostPairs];
  std::uint32_t leaves = 0, deepest = 0;
  while (walk.feed_count > 0 || walk.waiting_count > 0) {
    leaves += cut_kernels(GetParam()).walk[0](walk, chosen, 2 * kMostPairs);
    deepest = std::max(deepest, walk.waiting_count);
  }
  EXPECT_EQ(leaves, 60'000u);
  EXPECT_LE(deepest, kWalkStack);
}

// --- Edge cases: whatever the lights are, each once, a finite sum, the promise ---

struct EdgeCase {
  const char* name;
  Lights lights;
};

std::vector<EdgeCase> edge_cases() {
  std::vector<EdgeCase> cases;
  Dice dice(12);
  const auto vpls = [&](int count, auto make) {
    Lights lights;
    for (int i = 0; i < count; ++i) lights.vpls.push_back(make(i));
    return lights;
  };
  const auto any = [&](int) { return Vpl{dice.in_box(1.5f), dice.direction(), dice.color()}; };
  cases.push_back({"one", vpls(1, any)});
  cases.push_back({"two", vpls(2, any)});
  cases.push_back({"at one point", vpls(300, [&](int) { return Vpl{{0, 0.5f, 0}, dice.direction(), dice.color()}; })});
  cases.push_back({"identical", vpls(300, [](int) { return Vpl{{0, 1.2f, 0}, {0, -1, 0}, {1, 1, 1}}; })});
  cases.push_back({"dark", vpls(300, [&](int) { return Vpl{dice.in_box(1), dice.direction(), {0, 0, 0}}; })});
  cases.push_back({"some dark", vpls(300, [&](int i) {
                     return Vpl{dice.in_box(1), dice.direction(), Vec3{1, 1, 1} * static_cast<float>(i % 2)};
                   })});
  cases.push_back({"twelve orders", vpls(600, [&](int i) {
                     return Vpl{dice.in_box(1.5f), dice.direction(),
                                dice.color() * std::pow(10.0f, static_cast<float>(i % 13 - 6))};
                   })});
  cases.push_back({"points", mixed_lights(13, 0, 400, 0)});
  cases.push_back({"directionals", mixed_lights(14, 0, 0, 400)});
  cases.push_back({"none", {}});
  return cases;
}

TEST_P(PacketCut, EdgeCasesKeepThePromise) {
  for (const EdgeCase& edge : edge_cases()) {
    SCOPED_TRACE(edge.name);
    Dice dice(15);
    for (const float min_distance : {0.05f, 0.0f}) {
      const CutScene scene(edge.lights, 0.02f, 0, min_distance);
      SurfacePacket packet = random_surfaces(dice);
      set_lane(packet.albedo, 3, {0, 0, 0});  // reflects nothing
      set_lane(packet.albedo, 4, {1, 0, 0});
      CutCollector collector;
      const TileLight lit = packet_cut_of(scene, packet, collector, GetParam());
      for (int lane = 0; lane < kPacketSize; ++lane) {
        expect_once(scene, collector.cuts[lane]);
        expect_promise(check_lane(scene, packet, collector, lane), 0.02);
        const CutNodes heap = nodes_of(heap_cut_of(scene, packet, lane));
        expect_once(scene, heap);
        expect_promise(check_again(scene.lights, scene.trees, heap, point_of(packet, lane, scene)), 0.02);
        EXPECT_TRUE(std::isfinite(total_of(lit, packet, lane)));
        EXPECT_TRUE(std::isfinite(lit.lost[lane]));
      }
    }
  }
}

TEST_P(PacketCut, LightsBehindGiveNothingAndEndTheWalk) {
  Lights lights;
  Dice dice(16);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p = dice.in_box(1);
    lights.vpls.push_back({{p.x, -2 + 0.5f * p.y, p.z}, dice.direction(), dice.color()});
  }
  const CutScene scene(lights);
  SurfacePacket packet = random_surfaces(dice);
  for (int lane = 0; lane < kPacketSize; ++lane) {
    set_lane(packet.receivers.ns, lane, {0, 1, 0});
    set_lane(packet.receivers.ng, lane, {0, 1, 0});
  }
  CutCollector collector;
  const TileLight lit = packet_cut_of(scene, packet, collector, GetParam());
  for (int lane = 0; lane < kPacketSize; ++lane) {
    EXPECT_EQ(total_of(lit, packet, lane), 0);
    EXPECT_LE(lit.cut_size[lane], 2u);
    EXPECT_EQ(heap_cut_of(scene, packet, lane).total, 0);
  }
}

}  // namespace
}  // namespace lightcuts::test
