#include "kernels/cluster_bound.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "clusters.h"
#include "kernels/light_cluster.h"
#include "oracle/cluster_terms.h"

namespace lightcuts {
namespace {

/// A random cluster and a receiver that sees it in some awkward way.
struct Case {
  std::vector<Vpl> lights;
  Vec3 position, normal;
  float clamp = 0;
};

Case random_case(test::LightSamples& samples) {
  Case c;
  // Where and how large: from a nanometre to the whole, some far from the origin.
  const float size = std::pow(10.0f, samples.uniform(-6, 1));
  const Vec3 origin = samples.below(4) == 0 ? samples.direction() * 1000.0f : samples.point();
  Vec3 extent = samples.point() * size;
  if (samples.below(3) == 0) extent.x = 0;
  if (samples.below(3) == 0) extent.y = 0;
  if (samples.below(6) == 0) extent = {};
  // Axes: all equal, in a narrow cone, anywhere; along the world's or not.
  const Vec3 axes[3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
  const Vec3 main_axis = samples.below(2) == 0 ? axes[samples.below(3)] : samples.direction();
  const float spread = samples.below(3) == 0 ? 0.0f : std::pow(10.0f, samples.uniform(-4, 1));
  const std::uint32_t count = 1 + samples.below(12);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 axis = spread == 0 ? main_axis : normalize(main_axis + samples.direction() * spread);
    c.lights.push_back({origin + extent * samples.point(), axis, {1, 1, 1}});
  }
  // The receiver: inside, near, in the plane of the lights, far.
  const float away[5] = {0.0f, 0.5f, 2.0f, 30.0f, 1000.0f};
  c.position = origin + extent * samples.point() + samples.direction() * (size * away[samples.below(5)]);
  if (samples.below(4) == 0) c.position.y = origin.y;
  if (samples.below(20) == 0) c.position = c.lights[0].position;
  c.normal = samples.below(2) == 0 ? axes[samples.below(3)] : samples.direction();
  c.clamp = size * std::pow(10.0f, samples.uniform(-4, 0));
  return c;
}

TEST(ClusterBound, IsNeverBelowAnyVplOfTheCluster) {
  test::LightSamples samples(11);
  for (int round = 0; round < 200000; ++round) {
    const Case c = random_case(samples);
    const LightCluster cluster = test::cluster_of(c.lights);
    const float bound = vpl_bound<float>({c.position, c.normal}, cluster.box, cluster.cone, c.clamp * c.clamp);
    ASSERT_TRUE(std::isfinite(bound)) << "round " << round;
    const LitPoint<double> exact{{c.position.x, c.position.y, c.position.z}, {c.normal.x, c.normal.y, c.normal.z}};
    const double bound_in_double =
        vpl_bound<double>(exact, cluster.box, cluster.cone, static_cast<double>(c.clamp) * c.clamp);
    for (const Vpl& light : c.lights) {
      const double value = oracle::vpl_term(c.position, c.normal, light.position, light.axis, c.clamp);
      ASSERT_GE(bound, value) << "round " << round << ", " << c.lights.size() << " lights";
      ASSERT_GE(bound_in_double, value) << "round " << round << ", " << c.lights.size() << " lights";
    }
  }
}

TEST(ClusterBound, IsNeverBelowAnyPointOrSpotLight) {
  test::LightSamples samples(12);
  for (int round = 0; round < 100000; ++round) {
    const Case c = random_case(samples);
    const std::vector<PointLight> lights = test::lamps_at(c.lights, round % 8 != 0, samples);
    const LightCluster cluster = test::cluster_of(lights);
    const float bound = point_bound<float>({c.position, c.normal}, cluster.box, cluster.cone, c.clamp * c.clamp);
    for (const PointLight& light : lights)
      ASSERT_GE(bound, oracle::point_term(c.position, c.normal, light, c.clamp)) << "round " << round;
  }
}

TEST(ClusterBound, IsNeverBelowAnyDirectionalLight) {
  test::LightSamples samples(13);
  for (int round = 0; round < 100000; ++round) {
    const Vec3 around = samples.direction(), normal = samples.direction();
    const float spread = std::pow(10.0f, samples.uniform(-4, 1));
    Box box;
    double largest = 0;
    for (std::uint32_t i = 0; i < 1 + samples.below(8); ++i) {
      const Vec3 towards = normalize(around + samples.direction() * spread);
      box = extend(box, towards);
      const oracle::DoublePoint n(normal), w(towards);
      largest = std::max(largest, (n.x * w.x + n.y * w.y + n.z * w.z) / std::sqrt(w.x * w.x + w.y * w.y + w.z * w.z));
    }
    ASSERT_GE(directional_bound<float>(normal, box) * (1 + 1e-6), largest) << "round " << round;
  }
}

// What is dark must be known to be dark, or cuts would split it for nothing.
TEST(ClusterBound, IsZeroBehindTheReceiverBehindTheLightsAndInTheirPlane) {
  const Box floor{{0, 0, 0}, {3, 0, 3}};
  const DirectionCone up{{0, 1, 0}, 1};
  EXPECT_EQ(vpl_bound<float>({{1, 0, 1}, {0, 1, 0}}, floor, up, 1e-4f), 0.0f);
  EXPECT_EQ(vpl_bound<float>({{1, -1, 1}, {0, 1, 0}}, floor, up, 1e-4f), 0.0f);
  EXPECT_EQ(vpl_bound<float>({{1, 1, 1}, {0, 1, 0}}, floor, up, 1e-4f), 0.0f);
  EXPECT_GT(vpl_bound<float>({{1, 1, 1}, {0, -1, 0}}, floor, up, 1e-4f), 0.9f);
  EXPECT_EQ(point_bound<float>({{1, 1, 1}, {0, 1, 0}}, floor, {{0, 1, 0}, -1}, 1e-4f), 0.0f);
  EXPECT_EQ(directional_bound<float>({0, 0, 1}, {{-1, -1, -1}, {1, 1, -0.5f}}), 0.0f);
}

// A cluster of one light is known exactly.
TEST(ClusterBound, IsTightForOneLight) {
  test::LightSamples samples(14);
  for (int round = 0; round < 10000; ++round) {
    const Vec3 y = samples.point(), n = samples.direction(), x = samples.point(), a = samples.direction();
    const double value = oracle::vpl_term(y, n, x, a, 0.01);
    const float bound = vpl_bound<float>({y, n}, {x, x}, {a, 1}, 1e-4f);
    EXPECT_LE(bound, value * 1.001 + 1e-4) << "round " << round;
  }
}

}  // namespace
}  // namespace lightcuts
