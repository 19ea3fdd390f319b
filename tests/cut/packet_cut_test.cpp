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

void expect_promise(const CutScene& scene, const CutNodes& nodes, const CheckedPoint& point, double error) {
  EXPECT_TRUE(holds_each_light_once(scene.trees.vpls, nodes[0]));
  EXPECT_TRUE(holds_each_light_once(scene.trees.points, nodes[1]));
  EXPECT_TRUE(holds_each_light_once(scene.trees.directionals, nodes[2]));
  const DoubleCheck check = check_again(scene.lights, scene.trees, nodes, point);
  EXPECT_LE(check.largest, error * check.total);
  EXPECT_LE(std::abs(check.total - check.exact), check.bound_sum + 1e-5 * check.exact);
}

TEST_P(PacketCut, KeepsItsPromiseWhateverTheGuess) {
  Dice dice(3);
  for (const float error : {0.1f, 0.02f, 0.003f}) {
    const CutScene scene(mixed_lights(1, 500, 100, 60), error);
    // Guesses that are right, a hundred times too high and a hundred times too low.
    for (const double ratio : {1.0, 100.0, 0.01}) {
      const SurfacePacket packet = random_surfaces(dice, dice.between(0, 1) < 0.5f);
      CutCollector collector;
      const PacketLight lit = packet_cut_of(scene, packet, collector, GetParam(), {ratio});
      for (int lane = 0; lane < kPacketSize; ++lane) {
        const CheckedPoint point = point_of(packet, lane, scene);
        expect_promise(scene, collector.cuts[lane], point, error);
        const DoubleCheck check = check_again(scene.lights, scene.trees, collector.cuts[lane], point);
        EXPECT_NEAR(lit.total[lane], check.total, 1e-5 * check.total);
        EXPECT_NEAR(lit.largest_bound[lane], check.largest, 1e-4 * check.largest);
        std::size_t size = 0;
        for (const auto& nodes : collector.cuts[lane]) size += nodes.size();
        EXPECT_EQ(lit.size[lane], static_cast<float>(size));
      }
    }
  }
}

TEST_P(PacketCut, IsHardlyLargerThanTheHeaps) {
  Dice dice(8);
  const CutScene scene(mixed_lights(2, 3000, 0, 0));
  double heap = 0, packet_size = 0;
  for (int i = 0; i < 6; ++i) {
    const SurfacePacket packet = random_surfaces(dice);
    CutCollector collector;
    const PacketLight lit = packet_cut_of(scene, packet, collector, GetParam());
    for (int lane = 0; lane < kPacketSize; ++lane) {
      heap += static_cast<double>(heap_cut_of(scene, packet, lane).nodes.size());
      packet_size += lit.size[lane];
    }
  }
  EXPECT_LT(packet_size, 1.25 * heap);
  EXPECT_GT(packet_size, 0.9 * heap);
}

TEST_P(PacketCut, WithoutErrorItIsTheSumOverAllLights) {
  Dice dice(5);
  const CutScene scene(mixed_lights(3, 400, 60, 40), 0);
  const SurfacePacket packet = random_surfaces(dice);
  CutCollector collector;
  const PacketLight lit = packet_cut_of(scene, packet, collector, GetParam());
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const DoubleCheck check =
        check_again(scene.lights, scene.trees, collector.cuts[lane], point_of(packet, lane, scene));
    EXPECT_NEAR(lit.total[lane], check.exact, 1e-5 * check.exact);
    EXPECT_EQ(lit.largest_bound[lane], 0);
  }
}

TEST_P(PacketCut, FitsItsLargestCutWithLittleMoreErrorThanTheHeap) {
  Dice dice(9);
  for (const std::uint32_t most : {1u, 10u, 60u, 200u}) {
    const CutScene scene(mixed_lights(4, 2000, 100, 50), 0.001f, most);
    double heap_error = 0, packet_error = 0;
    for (int i = 0; i < 4; ++i) {
      const SurfacePacket packet = random_surfaces(dice);
      CutCollector collector;
      const PacketLight lit = packet_cut_of(scene, packet, collector, GetParam());
      for (int lane = 0; lane < kPacketSize; ++lane) {
        const CheckedPoint point = point_of(packet, lane, scene);
        EXPECT_LE(lit.size[lane], static_cast<float>(std::max(most, 3u)));
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

TEST_P(PacketCut, ALanesCutDoesNotDependOnItsNeighboursWithoutVisibility) {
  Dice dice(10);
  const CutScene scene(mixed_lights(5, 1500, 50, 20));
  const SurfacePacket packet = random_surfaces(dice);
  CutCollector together;
  packet_cut_of(scene, packet, together, GetParam());
  for (int lane = 0; lane < kPacketSize; lane += 5) {
    SurfacePacket alone = packet;
    alone.receivers.active = 1u << lane;
    CutCollector collector;
    packet_cut_of(scene, alone, collector, GetParam());
    for (int kind = 0; kind < 3; ++kind) {
      auto a = together.cuts[lane][kind], b = collector.cuts[lane][kind];
      std::sort(a.begin(), a.end());
      std::sort(b.begin(), b.end());
      EXPECT_EQ(a, b);
    }
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
  SurfacePacket packet = random_surfaces(dice);
  PacketWalk walk{};
  walk.nodes = scene.trees.vpls.nodes.data();
  walk.min_distance_sq = 1e-4f;
  walk.size_limit = 1e9f;
  std::fill(std::begin(walk.threshold), std::end(walk.threshold), -1.0f);
  ChosenNode chosen[64];
  const CutKernels& kernels = cut_kernels(GetParam());
  std::uint32_t count = kernels.start[0](packet.receivers, walk, 0xffff, chosen), deepest = 0;
  while (walk.waiting_count > 0) {
    deepest = std::max(deepest, walk.waiting_count);
    count += kernels.walk[0](packet.receivers, walk, chosen, 64);
  }
  EXPECT_EQ(count, 100'000u);
  EXPECT_LE(deepest, 1u);
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
      const PacketLight lit = packet_cut_of(scene, packet, collector, GetParam());
      for (int lane = 0; lane < kPacketSize; ++lane) {
        const CheckedPoint point = point_of(packet, lane, scene);
        expect_promise(scene, collector.cuts[lane], point, 0.02);
        expect_promise(scene, nodes_of(heap_cut_of(scene, packet, lane)), point, 0.02);
        EXPECT_TRUE(std::isfinite(lit.total[lane]));
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
  const PacketLight lit = packet_cut_of(scene, packet, collector, GetParam());
  for (int lane = 0; lane < kPacketSize; ++lane) {
    EXPECT_EQ(lit.total[lane], 0);
    EXPECT_LE(lit.size[lane], 2);
    EXPECT_EQ(heap_cut_of(scene, packet, lane).total, 0);
  }
}

}  // namespace
}  // namespace lightcuts::test
