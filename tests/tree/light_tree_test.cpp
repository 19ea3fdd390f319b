#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstring>

#include "cpu/tree/assemble_tree.h"
#include "cpu/tree/build_light_trees.h"
#include "cpu/tree/leaf_clusters.h"
#include "cpu/tree/ploc.h"
#include "cpu/tree/redraw.h"
#include "light_samples.h"
#include "lightcuts/error.h"
#include "tree_promises.h"

namespace lightcuts {
namespace {

constexpr TreeBuilder kBuilders[] = {TreeBuilder::agglomerative, TreeBuilder::ploc, TreeBuilder::morton};
constexpr Metric kMetrics[] = {Metric::walter, Metric::distance, Metric::distance_color, Metric::distance_direction,
                               Metric::distance_color_direction};

LightTrees build(const std::vector<Vpl>& vpls, TreeBuilder builder, Metric metric = Metric::walter,
                 std::uint64_t seed = 1) {
  Lights lights;
  lights.vpls = vpls;
  return build_light_trees(lights, 1.7f, {builder, metric, seed});
}

bool same(const LightTree& a, const LightTree& b) {
  return a.depth == b.depth && a.nodes.size() == b.nodes.size() &&
         std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(LightNode)) == 0;
}

TEST(LightTree, KeepsItsPromisesForAllBuildersAndMetrics) {
  test::LightSamples samples(41);
  const std::vector<Vpl> scattered = samples.scattered(3000), walls = samples.on_walls(5000),
                         ties = samples.with_ties(3000);
  for (const TreeBuilder builder : kBuilders) {
    for (const Metric metric : kMetrics) {
      for (const auto* lights : {&scattered, &walls, &ties})
        test::expect_valid(build(*lights, builder, metric).vpls, *lights);
    }
  }
}

TEST(LightTree, HoldsOneLightTwoLightsAndManyAtOnePoint) {
  test::LightSamples samples(42);
  std::vector<Vpl> one_point = samples.scattered(5000);
  for (Vpl& light : one_point) light.position = {0.25f, 0.5f, 0.75f};
  std::vector<Vpl> dark = samples.on_walls(5000);
  for (Vpl& light : dark) light.intensity = {};
  std::vector<Vpl> wide = samples.on_walls(5000);
  for (Vpl& light : wide) light.intensity *= std::pow(10.0f, samples.uniform(-12, 0));
  const std::vector<Vpl> identical(5000, one_point[0]);
  for (const TreeBuilder builder : kBuilders) {
    for (std::size_t n = 1; n < 10; ++n) {
      const std::vector<Vpl> few = samples.scattered(n);
      test::expect_valid(build(few, builder).vpls, few);
    }
    for (const std::vector<Vpl>& lights : {one_point, dark, wide, identical})
      test::expect_valid(build(lights, builder).vpls, lights);
  }
}

// Each light farther from the others than all before: every builder may make a list of it.
TEST(LightTree, HoldsADegenerateChain) {
  constexpr std::uint32_t kCount = 100000;
  const std::vector<Vpl> lights(kCount, Vpl{{0, 0, 0}, {0, 1, 0}, {1, 0.5f, 0.1f}});
  MergeTree chain;
  chain.children.push_back({0, 1});
  for (std::uint32_t k = 1; k + 1 < kCount; ++k) chain.children.push_back({k + 1, kCount + k - 1});
  const LightTree tree = assemble_tree(chain, leaf_clusters(lights, Metric::walter, 1).clusters, 1);
  ASSERT_EQ(tree.nodes.size(), 2 * std::size_t{kCount} - 1);
  EXPECT_EQ(tree.depth, kCount);
  EXPECT_NEAR(tree.nodes[0].intensity.z, 0.1 * kCount, 1e-5 * 0.1 * kCount);
}

// Equally spaced and ever brighter: each prefers its neighbour on the same side, so that one pair alone chooses each other.
TEST(LightTree, TakesFewRoundsForLightsInARow) {
  std::vector<Vpl> lights;
  for (int i = 0; i < 65536; ++i)
    lights.push_back({{static_cast<float>(i), 0, 0}, {0, 1, 0}, Vec3{1, 1, 1} * (1 + 1e-4f * static_cast<float>(i))});
  int rounds = 0;
  const MergeTree tree =
      build_ploc(leaf_clusters(lights, Metric::walter, 1e5f), {}, [&](double) { return ++rounds < 200; });
  EXPECT_EQ(tree.leaf_count(), lights.size());
  EXPECT_LT(rounds, 60);
}

TEST(LightTree, GreedyBuilderOfManyLightsKeepsItsPromises) {
  test::LightSamples samples(48);
  const std::vector<Vpl> lights = samples.on_walls(40000);
  test::expect_valid(build(lights, TreeBuilder::agglomerative).vpls, lights);
}

TEST(LightTree, IsTheSameForAnyNumberOfThreads) {
  test::LightSamples samples(43);
  const std::vector<Vpl> lights = samples.on_walls(8000);
  for (const TreeBuilder builder : kBuilders) {
    const LightTree many = build(lights, builder).vpls;
    for (const std::size_t threads : {1, 2, 5}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      EXPECT_TRUE(same(build(lights, builder).vpls, many)) << threads << " threads";
    }
  }
}

// Chi-square over seeds: at the root each light stands with a probability proportional to its luminance.
TEST(LightTree, DrawsRepresentativesInProportionToIntensity) {
  test::LightSamples samples(44);
  std::vector<Vpl> lights = samples.scattered(8);
  lights[3].intensity = {};
  lights[5].intensity *= 4.0f;
  double total = 0;
  for (const Vpl& light : lights) total += luminance(light.intensity);
  const LeafClusters leaves = leaf_clusters(lights, Metric::walter, 1.7f);
  for (const TreeBuilder builder : kBuilders) {
    constexpr int kSeeds = 5000;
    std::vector<double> hits(lights.size(), 0);
    for (int seed = 0; seed < kSeeds; ++seed)
      hits[build(lights, builder, Metric::walter, static_cast<std::uint64_t>(seed)).vpls.nodes[0].representative] += 1;
    double chi_square = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const double expected = kSeeds * luminance(lights[i].intensity) / total;
      if (expected > 0) {
        chi_square += (hits[i] - expected) * (hits[i] - expected) / expected;
      } else {
        EXPECT_EQ(hits[i], 0);
      }
    }
    EXPECT_LT(chi_square, 22.5);  // 6 degrees of freedom, one in a thousand
  }
}

// Builders differ in the topology, so agreement is at the root alone; but order of building must not matter.
TEST(LightTree, DrawsRepresentativesWhateverTheOrderOfMerging) {
  test::LightSamples samples(45);
  const std::vector<Vpl> lights = samples.scattered(4);
  const std::vector<LightCluster> leaves = leaf_clusters(lights, Metric::walter, 1).clusters;
  const MergeTree first{{{0, 1}, {2, 3}, {4, 5}}}, second{{{3, 2}, {1, 0}, {4, 5}}};
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    EXPECT_EQ(assemble_tree(first, leaves, seed).nodes[0].representative,
              assemble_tree(second, leaves, seed).nodes[0].representative);
  }
}

TEST(LightTree, RedrawnItIsTheTreeOfTheOtherSeed) {
  test::LightSamples samples(47);
  std::vector<LightRange> scratch;
  for (const std::size_t count : {1u, 2u, 50u, 5000u}) {
    const std::vector<Vpl> lights = samples.scattered(count);
    for (const TreeBuilder builder : kBuilders) {
      const LightTree first = build(lights, builder, Metric::walter, 1).vpls;
      const LightTree second = build(lights, builder, Metric::walter, 2).vpls;
      if (count > 10) {
        EXPECT_FALSE(same(first, second));
      }
      LightTree tree = first;
      redraw_representatives(tree, 2, scratch);
      EXPECT_TRUE(same(tree, second)) << count;
      redraw_representatives(tree, 1, scratch);
      EXPECT_TRUE(same(tree, first)) << count;
    }
  }
}

TEST(LightTree, BuildsOneTreeAKind) {
  test::LightSamples samples(46);
  Lights lights;
  lights.vpls = samples.scattered(100);
  for (int i = 0; i < 50; ++i) {
    lights.points.push_back({samples.point(), samples.point(), samples.direction(), 0.9f, 0.5f});
    if (i % 2 == 0) lights.points.back().cos_outer = -2;
    lights.directionals.push_back({samples.direction(), samples.point()});
  }
  const LightTrees trees = build_light_trees(lights, 1.7f, {});
  EXPECT_EQ(trees.vpls.nodes.size(), 199u);
  EXPECT_EQ(trees.points.nodes.size(), 99u);
  EXPECT_EQ(trees.directionals.nodes.size(), 99u);
  EXPECT_EQ(trees.points.nodes[0].cos_half_angle, -1.0f);
  for (const DirectionalLight& light : lights.directionals)
    EXPECT_TRUE(test::contains(trees.directionals.nodes[0].box, {-light.direction, -light.direction}));
  const LightTrees none = build_light_trees({}, 1.7f, {});
  EXPECT_TRUE(none.vpls.nodes.empty() && none.points.nodes.empty() && none.directionals.nodes.empty());
}

TEST(LightTree, ReportsProgressAndStops) {
  test::LightSamples samples(47);
  Lights lights;
  lights.vpls = samples.scattered(9000);
  double last = 0;
  build_light_trees(lights, 1.7f, {TreeBuilder::agglomerative}, [&](const char* stage, double done) {
    EXPECT_STREQ(stage, "tree");
    EXPECT_GE(done, last);
    last = done;
    return true;
  });
  EXPECT_EQ(last, 1.0);
  const LightTrees stopped = build_light_trees(lights, 1.7f, {}, [](const char*, double) { return false; });
  EXPECT_TRUE(stopped.vpls.nodes.empty());
}

// Memory per light: the VPL and the tree.
TEST(LightTree, TakesLessThanTwoHundredBytesALight) { EXPECT_LT(sizeof(Vpl) + 2 * sizeof(LightNode), 200u); }

TEST(LightTrees, TenMillionLightsNeedWhatIsSaid) {
  static_assert(sizeof(Vpl) + 2 * sizeof(LightNode) < 200);
  constexpr std::uint64_t lights = 10'000'000;
  for (const TreeBuilder builder : kBuilders) {
    const std::uint64_t bytes = light_tree_build_bytes(lights, builder);
    EXPECT_GT(bytes, lights * 2 * sizeof(LightNode));
    EXPECT_LT(bytes, std::uint64_t{4} << 30);
  }
}

}  // namespace
}  // namespace lightcuts
