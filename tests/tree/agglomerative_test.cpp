#include "cpu/tree/agglomerative.h"

#include <gtest/gtest.h>

#include "cpu/tree/leaf_clusters.h"
#include "light_samples.h"
#include "oracle/greedy_tree.h"

namespace lightcuts {
namespace {

constexpr Metric kMetrics[] = {Metric::walter, Metric::distance, Metric::distance_color, Metric::distance_direction,
                               Metric::distance_color_direction};

void expect_greedy(const LeafClusters& leaves, const char* what) {
  const auto expected = oracle::greedy_merges(leaves.clusters, leaves.scale);
  const MergeTree built = build_agglomerative(leaves);
  ASSERT_EQ(built.children.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    ASSERT_EQ(built.children[k], expected[k]) << what << ", metric " << static_cast<int>(leaves.scale.metric) << ", "
                                              << leaves.clusters.size() << " lights, merge " << k;
  }
}

TEST(Agglomerative, MergesAsTheNaiveGreedyBuilderDoes) {
  for (const Metric metric : kMetrics) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      test::LightSamples samples(seed);
      expect_greedy(leaf_clusters(samples.scattered(150), metric, 1.7f), "scattered");
      expect_greedy(leaf_clusters(samples.on_walls(150), metric, 1.7f), "on walls");
      expect_greedy(leaf_clusters(samples.with_ties(120), metric, 4), "with ties");
    }
  }
}

TEST(Agglomerative, MergesAsTheNaiveBuilderForFewAndForEqualLights) {
  for (const Metric metric : kMetrics) {
    for (std::size_t n = 1; n < 12; ++n) {
      test::LightSamples samples(n);
      expect_greedy(leaf_clusters(samples.scattered(n), metric, 1.7f), "few");
      expect_greedy(leaf_clusters(samples.with_ties(n), metric, 4), "few with ties");
      expect_greedy(leaf_clusters(std::vector<Vpl>(n, samples.scattered(1)[0]), metric, 1), "identical");
    }
  }
}

TEST(Agglomerative, MergesAsTheNaiveBuilderWithIntensitiesOverTwelveOrders) {
  for (const Metric metric : kMetrics) {
    test::LightSamples samples(7);
    std::vector<Vpl> lights = samples.on_walls(150);
    for (Vpl& light : lights) light.intensity *= std::pow(10.0f, samples.uniform(-12, 0));
    for (std::size_t i = 0; i < lights.size(); i += 10) lights[i].intensity = {};
    expect_greedy(leaf_clusters(lights, metric, 1.7f), "twelve orders");
  }
}

TEST(Agglomerative, MergesPointsAndDirectionalsAsTheNaiveBuilder) {
  test::LightSamples samples(3);
  std::vector<PointLight> points;
  std::vector<DirectionalLight> directionals;
  for (int i = 0; i < 100; ++i) {
    PointLight light{samples.point(), samples.point(), samples.direction(), -1, -2};
    if (i % 2 == 0) light.cos_inner = 0.9f, light.cos_outer = 0.5f;
    points.push_back(light);
    directionals.push_back({samples.direction(), samples.point()});
  }
  for (const Metric metric : kMetrics) {
    expect_greedy(leaf_clusters(points, metric, 1.7f), "points");
    expect_greedy(leaf_clusters(directionals, metric), "directionals");
  }
}

// A quadratic builder would take minutes for these.
TEST(Agglomerative, StaysFastOnDegenerateInput) {
  constexpr std::size_t kCount = 10000;
  test::LightSamples samples(5);
  const Vpl one = samples.scattered(1)[0];
  std::vector<Vpl> identical(kCount, one), one_point = samples.scattered(kCount), dark = samples.on_walls(kCount),
                                           wide = samples.on_walls(kCount);
  for (Vpl& light : one_point) light.position = one.position;
  for (Vpl& light : dark) light.intensity = {};
  for (Vpl& light : wide) light.intensity *= std::pow(10.0f, samples.uniform(-12, 0));
  for (const Metric metric : kMetrics) {
    for (const auto* lights : {&identical, &one_point, &dark, &wide})
      EXPECT_EQ(build_agglomerative(leaf_clusters(*lights, metric, 1.7f)).children.size(), kCount - 1);
  }
}

TEST(Agglomerative, StopsWhereProgressAsks) {
  test::LightSamples samples(5);
  const MergeTree tree =
      build_agglomerative(leaf_clusters(samples.scattered(20000), Metric::walter, 1.7f), [](double) { return false; });
  EXPECT_TRUE(tree.children.empty());
}

}  // namespace
}  // namespace lightcuts
