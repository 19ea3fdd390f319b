#include <gtest/gtest.h>

#include <algorithm>

#include "cpu/tree/agglomerative.h"
#include "cpu/tree/assemble_tree.h"
#include "cpu/tree/leaf_clusters.h"
#include "light_samples.h"
#include "oracle/classic_bound.h"
#include "oracle/cut_oracle.h"

namespace lightcuts {
namespace {

struct Means {
  double cut = 0, relative_error = 0;
};

/// 300 lights on the walls of a unit cube, 400 points on its floor; means over a few such cubes.
template <class Bound>
Means example(double error, const Bound& bound) {
  Means means;
  constexpr int kCubes = 8, kPoints = 50;
  for (std::uint64_t seed = 1; seed <= kCubes; ++seed) {
    test::LightSamples samples(seed);
    const std::vector<Vpl> lights = samples.on_walls(300);
    const LeafClusters leaves = leaf_clusters(lights, Metric::walter, std::sqrt(3.0f));
    const LightTree tree = assemble_tree(build_agglomerative(leaves), leaves.clusters, seed);
    for (int i = 0; i < kPoints; ++i) {
      const oracle::CutPoint point{{samples.uniform(), 0, samples.uniform()}, {0, 1, 0}, 0.5, 0.01};
      const oracle::CutResult cut = oracle::heap_cut(tree, lights, point, error, bound);
      const double exact = oracle::brute_force(lights, point);
      EXPECT_LE(std::abs(cut.total - exact), cut.bound_sum + 1e-6 * exact);
      means.cut += static_cast<double>(cut.nodes.size()) / (kCubes * kPoints);
      means.relative_error += std::abs(cut.total - exact) / exact / (kCubes * kPoints);
    }
  }
  return means;
}

// Reference, section 10: mean cut 241, 95 and 39 for 0, 2 and 10 %, mean error 0, 1.0 and 2.8 %.
TEST(CutExample, HasTheReferencesCutSizesWithTheClassicBound) {
  const Means all = example(0, oracle::classic_bound), two = example(0.02, oracle::classic_bound),
              ten = example(0.1, oracle::classic_bound);
  EXPECT_NEAR(all.cut, 241, 15);
  EXPECT_LT(all.relative_error, 1e-5);
  EXPECT_NEAR(two.cut, 95, 8);
  EXPECT_NEAR(two.relative_error, 0.010, 0.003);
  EXPECT_NEAR(ten.cut, 39, 5);
  EXPECT_NEAR(ten.relative_error, 0.028, 0.008);
}

TEST(CutExample, NeedsFewerNodesWithOurBound) {
  const Means all = example(0, oracle::node_bound), two = example(0.02, oracle::node_bound),
              ten = example(0.1, oracle::node_bound);
  const Means two_classic = example(0.02, oracle::classic_bound), ten_classic = example(0.1, oracle::classic_bound);
  EXPECT_LT(all.relative_error, 1e-5);
  EXPECT_LT(two.cut, two_classic.cut);
  EXPECT_LT(ten.cut, ten_classic.cut);
}

}  // namespace
}  // namespace lightcuts
