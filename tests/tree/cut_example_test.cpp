#include <gtest/gtest.h>

#include "cpu/tree/agglomerative.h"
#include "cpu/tree/assemble_tree.h"
#include "cpu/tree/leaf_clusters.h"
#include "light_samples.h"
#include "oracle/cut_oracle.h"

namespace lightcuts {
namespace {

/// The classic bound: largest receiver cosine, largest emitter cosine and smallest distance, each by itself; cosines by
/// the reference's equation (1.5) in a fixed frame. What the reference's worked example was counted with.
double classic_cosine(Vec3 axis, const double lo[3], const double hi[3]) {
  const Vec3 helper = std::abs(axis.x) < 0.9f ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 side = normalize(cross(axis, helper)), up = cross(axis, side);
  double least[3], most[3];
  const Vec3 frame[3] = {side, up, axis};
  for (int k = 0; k < 3; ++k) {
    least[k] = most[k] = 0;
    for (int i = 0; i < 3; ++i) {
      const double u = component(frame[k], i);
      least[k] += std::min(u * lo[i], u * hi[i]);
      most[k] += std::max(u * lo[i], u * hi[i]);
    }
  }
  double across_sq = 0;
  for (int k = 0; k < 2; ++k) {
    const bool ahead = most[2] >= 0;
    const double nearest = least[k] <= 0 && most[k] >= 0 ? 0 : std::min(std::abs(least[k]), std::abs(most[k]));
    const double used = ahead ? nearest : std::max(std::abs(least[k]), std::abs(most[k]));
    across_sq += used * used;
  }
  const double length = std::sqrt(across_sq + most[2] * most[2]);
  return length > 0 ? most[2] / length : 1;
}

double classic_bound(const oracle::CutPoint& point, const LightNode& node) {
  const oracle::DoublePoint y(point.position), b(node.box.lo), t(node.box.hi);
  const double lo[3] = {b.x - y.x, b.y - y.y, b.z - y.z}, hi[3] = {t.x - y.x, t.y - y.y, t.z - y.z};
  const double back_lo[3] = {-hi[0], -hi[1], -hi[2]}, back_hi[3] = {-lo[0], -lo[1], -lo[2]};
  double distance_sq = 0;
  for (int k = 0; k < 3; ++k) distance_sq += std::pow(std::max({lo[k], -hi[k], 0.0}), 2);
  const double receiver = std::max(classic_cosine(point.normal, lo, hi), 0.0);
  const double away = std::acos(std::clamp(classic_cosine(node.axis, back_lo, back_hi), -1.0, 1.0));
  const double half = std::acos(std::clamp(double(node.cos_half_angle), -1.0, 1.0));
  const double emitter = away <= half ? 1 : std::max(std::cos(away - half), 0.0);
  return receiver * emitter / std::max(distance_sq, point.clamp * point.clamp);
}

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
  const Means all = example(0, classic_bound), two = example(0.02, classic_bound), ten = example(0.1, classic_bound);
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
  const Means two_classic = example(0.02, classic_bound), ten_classic = example(0.1, classic_bound);
  EXPECT_LT(all.relative_error, 1e-5);
  EXPECT_LT(two.cut, two_classic.cut);
  EXPECT_LT(ten.cut, ten_classic.cut);
}

}  // namespace
}  // namespace lightcuts
