#include <gtest/gtest.h>

#include <cstring>

#include "backend/build_light_tree.h"
#include "cpu/tree/build_light_trees.h"
#include "kernels/serial_executor.h"
#include "light_samples.h"
#include "tree_promises.h"

namespace lightcuts {
namespace {

constexpr float kDiagonal = 1.7f;

LightTree by_executor(const std::vector<Vpl>& lights, Metric metric, std::uint64_t seed = 1) {
  SerialExecutor exec;
  LightTreeBuild options;
  options.scale = {metric, 1 / kDiagonal, kDiagonal * kDiagonal};
  options.seed = seed;
  const auto built = build_light_tree(exec, lights.data(), static_cast<std::uint32_t>(lights.size()), options);
  LightTree tree;
  tree.depth = built.depth;
  if (built.leaf_count > 0) tree.nodes.assign(built.nodes(), built.nodes() + built.node_count());
  return tree;
}

LightTree by_cpu(const std::vector<Vpl>& vpls, Metric metric) {
  Lights lights;
  lights.vpls = vpls;
  return build_light_trees(lights, kDiagonal, {TreeBuilder::ploc, metric, 1}).vpls;
}

TEST(ExecutorTree, KeepsTheTreesPromises) {
  test::LightSamples samples(5);
  for (const Metric metric : {Metric::walter, Metric::distance, Metric::distance_color, Metric::distance_direction,
                              Metric::distance_color_direction}) {
    for (const std::size_t n : {1, 2, 3, 31, 255, 256, 257, 3001, 4097}) {
      for (const auto& lights : {samples.scattered(n), samples.on_walls(n), samples.with_ties(n)})
        test::expect_valid(by_executor(lights, metric), lights);
    }
  }
  EXPECT_TRUE(by_executor({}, Metric::walter).nodes.empty());
}

/// Sum of the metric over all inner nodes: what a builder makes small.
double cost(const LightTree& tree, Metric metric) {
  const MetricScale scale{metric, 1 / kDiagonal, kDiagonal * kDiagonal};
  double sum = 0;
  for (const LightNode& node : tree.nodes) {
    if (node.is_leaf()) continue;
    const auto cluster = [&](std::uint32_t i) {
      const LightNode& n = tree.nodes[i];
      return LightCluster{
          n.box, {n.axis, n.cos_half_angle}, n.intensity, chromaticity(n.intensity), luminance(n.intensity)};
    };
    sum += static_cast<double>(cluster_size(cluster(node.first_child), cluster(node.second_child()), scale));
  }
  return sum;
}

TEST(ExecutorTree, IsAsGoodAsTheCpus) {
  // Few large nodes make most of the sum, so that one set of lights says little.
  constexpr int kSets = 6;
  for (const Metric metric : {Metric::walter, Metric::distance_color_direction}) {
    for (const bool on_walls : {false, true}) {
      double mean = 0;
      for (int set = 0; set < kSets; ++set) {
        test::LightSamples samples(6 + static_cast<std::uint64_t>(set));
        const auto lights = on_walls ? samples.on_walls(20000) : samples.scattered(20000);
        mean += cost(by_executor(lights, metric), metric) / cost(by_cpu(lights, metric), metric) / kSets;
      }
      EXPECT_LT(mean, 1.015);
    }
  }
}

TEST(ExecutorTree, GetsOutOfLightsThatAllPreferTheNext) {
  // Ever brighter along a line, so that in every window the dimmer neighbour is the better partner.
  std::vector<Vpl> lights;
  float brightness = 1e-15f;
  for (int i = 0; i < 3000; ++i, brightness *= 1.02f)
    lights.push_back({{static_cast<float>(i), 0, 0}, {0, 0, 1}, Vec3{1, 1, 1} * brightness});
  test::expect_valid(by_executor(lights, Metric::walter), lights);
}

TEST(ExecutorTree, HalvesLightsThatAreAllTheSame) {
  for (const std::size_t n : {255, 4096, 5000}) {
    const std::vector<Vpl> lights(n, {{1, 2, 3}, {0, 0, 1}, {1, 1, 1}});
    const LightTree tree = by_executor(lights, Metric::walter);
    test::expect_valid(tree, lights);
    EXPECT_LE(tree.depth, 15u);
  }
}

TEST(ExecutorTree, SeedChoosesRepresentativesAlone) {
  test::LightSamples samples(7);
  const std::vector<Vpl> lights = samples.on_walls(2000);
  const LightTree a = by_executor(lights, Metric::walter, 1), b = by_executor(lights, Metric::walter, 2);
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_NE(std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(LightNode)), 0);
  EXPECT_DOUBLE_EQ(cost(a, Metric::walter), cost(b, Metric::walter));
}

}  // namespace
}  // namespace lightcuts
