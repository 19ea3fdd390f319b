#include <cstdio>
#include <cstring>

#include "backend/build_light_tree.h"
#include "cpu/tree/build_light_trees.h"
#include "cuda/device_fixture.h"
#include "cuda/device_lights.h"
#include "cuda/light_tree.h"
#include "cut/cut_scene.h"
#include "kernels/serial_executor.h"
#include "lightcuts/error.h"
#include "tree/light_samples.h"
#include "tree/tree_promises.h"

namespace lightcuts::cuda {
namespace {

constexpr float kDiagonal = 1.7f;

class Trees : public OnDevice {
 protected:
  LightTrees build(const Lights& lights, Metric metric = Metric::walter) {
    const DeviceLights sent = send_lights(*device, lights);
    return download_light_trees(build_light_trees(*device, sent, kDiagonal, {TreeBuilder::ploc, metric, 1}));
  }
};

LightTree by_serial_executor(const std::vector<Vpl>& vpls, Metric metric) {
  SerialExecutor exec;
  LightTreeBuild options;
  options.scale = {metric, 1 / kDiagonal, kDiagonal * kDiagonal};
  const auto built = build_light_tree(exec, vpls.data(), static_cast<std::uint32_t>(vpls.size()), options);
  return {{built.nodes(), built.nodes() + built.node_count()}, built.depth};
}

bool same_bits(const LightTree& a, const LightTree& b) {
  return a.depth == b.depth && a.nodes.size() == b.nodes.size() &&
         std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(LightNode)) == 0;
}

/// Clusters of one tree, as (smallest box corner, leaves), that the other has too.
double share_of_equal_nodes(const LightTree& a, const LightTree& b) {
  const auto keys = [](const LightTree& tree) {
    std::vector<std::array<float, 7>> result;
    for (const LightNode& n : tree.nodes) {
      result.push_back(
          {n.box.lo.x, n.box.lo.y, n.box.lo.z, n.box.hi.x, n.box.hi.y, n.box.hi.z, static_cast<float>(n.leaf_count)});
    }
    std::sort(result.begin(), result.end());
    return result;
  };
  const auto ka = keys(a), kb = keys(b);
  std::vector<std::array<float, 7>> both;
  std::set_intersection(ka.begin(), ka.end(), kb.begin(), kb.end(), std::back_inserter(both));
  return static_cast<double>(both.size()) / static_cast<double>(std::max(ka.size(), kb.size()));
}

TEST_F(Trees, KeepTheirPromisesAtManySizes) {
  test::LightSamples samples(11);
  for (const Metric metric : {Metric::walter, Metric::distance_color_direction}) {
    for (const std::size_t n : {1, 2, 3, 31, 32, 33, 255, 256, 257, 1000, 20011}) {
      if (reduced() && n > 1000) break;
      for (const auto& vpls : {samples.scattered(n), samples.on_walls(n), samples.with_ties(n)}) {
        Lights lights;
        lights.vpls = vpls;
        test::expect_valid(build(lights, metric).vpls, vpls);
      }
    }
  }
}

TEST_F(Trees, AreThoseOfTheSerialExecutorButForRounding) {
  test::LightSamples samples(12);
  for (const Metric metric : {Metric::walter, Metric::distance, Metric::distance_direction}) {
    Lights lights;
    lights.vpls = samples.on_walls(reduced() ? 5000 : 50000);
    const LightTree gpu = build(lights, metric).vpls, cpu = by_serial_executor(lights.vpls, metric);
    const double equal = share_of_equal_nodes(gpu, cpu);
    std::printf("  metric %d: %.3f %% of the nodes are equal, depth %u and %u\n", static_cast<int>(metric), 100 * equal,
                gpu.depth, cpu.depth);
    EXPECT_GT(equal, 0.98);
  }
}

TEST_F(Trees, OfAMillionLightsAreTheSameTwice) {
  test::LightSamples samples(13);
  Lights lights;
  lights.vpls = samples.on_walls(reduced() ? 1 << 13 : 1 << 20);
  const LightTree a = build(lights).vpls, b = build(lights).vpls;
  EXPECT_TRUE(same_bits(a, b));
  std::printf("  depth %u; most memory %.1f MB\n", a.depth, static_cast<double>(device->peak()) / 1e6);
  EXPECT_LT(device->peak(), 512u << 20);
}

TEST_F(Trees, OfAllKindsAreBuilt) {
  const Lights lights = test::mixed_lights(3, 700, 130, 65);
  const LightTrees trees = build(lights);
  EXPECT_EQ(trees.vpls.nodes.size(), 1399u);
  EXPECT_EQ(trees.points.nodes.size(), 259u);
  EXPECT_EQ(trees.directionals.nodes.size(), 129u);
  std::vector<std::uint32_t> everything{0};
  EXPECT_TRUE(test::holds_each_light_once(trees.points, everything));
  EXPECT_TRUE(test::holds_each_light_once(trees.directionals, everything));
}

TEST_F(Trees, FromTheCpuComeBackAsTheyWere) {
  const Lights lights = test::mixed_lights(4, 500, 30, 20);
  const LightTrees trees = build_light_trees(lights, kDiagonal, {TreeBuilder::agglomerative, Metric::walter, 1}, {});
  const DeviceLights sent = send_lights(*device, lights);
  const LightTrees back = download_light_trees(upload_light_trees(*device, trees, sent));
  EXPECT_TRUE(same_bits(trees.vpls, back.vpls));
  EXPECT_TRUE(same_bits(trees.points, back.points));
  EXPECT_TRUE(same_bits(trees.directionals, back.directionals));
}

TEST_F(Trees, ThatAreNoTreesOfTheLightsAreRefused) {
  const Lights lights = test::mixed_lights(5, 40, 0, 0);
  const DeviceLights sent = send_lights(*device, lights);
  LightTrees trees = build_light_trees(lights, kDiagonal, {}, {});
  trees.vpls.nodes[0].first_child = 1000;
  EXPECT_THROW(upload_light_trees(*device, trees, sent), Error);
  trees.vpls.nodes[0].first_child = 0;
  EXPECT_THROW(upload_light_trees(*device, trees, sent), Error);
  EXPECT_THROW(upload_light_trees(*device, {}, sent), Error);
}

}  // namespace
}  // namespace lightcuts::cuda
