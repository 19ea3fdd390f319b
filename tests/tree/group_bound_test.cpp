#include "kernels/group_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "clusters.h"
#include "oracle/cluster_terms.h"

namespace lightcuts {
namespace {

struct Point {
  Vec3 position, normal;
};

/// Lights, and receivers that see them in some awkward way.
struct Case {
  std::vector<Vpl> lights;
  std::vector<Point> points;
  float clamp = 0;
};

Vec3 main_direction(test::LightSamples& samples) {
  const Vec3 axes[3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
  return samples.below(2) == 0 ? axes[samples.below(3)] : samples.direction();
}

/// How far directions spread about a main one: not at all, hardly, anywhere.
float some_spread(test::LightSamples& samples) {
  return samples.below(3) == 0 ? 0.0f : std::pow(10.0f, samples.uniform(-5, 1));
}

Vec3 spread_about(test::LightSamples& samples, Vec3 main, float spread) {
  return spread == 0 ? main : normalize(main + samples.direction() * spread);
}

Vec3 some_extent(test::LightSamples& samples, float size) {
  Vec3 extent = samples.point() * size;
  if (samples.below(3) == 0) extent.x = 0;
  if (samples.below(3) == 0) extent.y = 0;
  if (samples.below(6) == 0) extent = {};
  return extent;
}

Case random_case(test::LightSamples& samples) {
  Case c;
  const float size = std::pow(10.0f, samples.uniform(-6, 1));
  const Vec3 origin = samples.below(4) == 0 ? samples.direction() * 1000.0f : samples.point();
  const Vec3 extent = some_extent(samples, size);
  const Vec3 axis = main_direction(samples);
  const float axis_spread = some_spread(samples);
  const std::uint32_t light_count = 1 + samples.below(8);
  for (std::uint32_t i = 0; i < light_count; ++i)
    c.lights.push_back({origin + extent * samples.point(), spread_about(samples, axis, axis_spread), {1, 1, 1}});

  // The receivers: inside, near, in the plane of the lights, far; in a plane or anywhere; of one normal or of many.
  const float away[5] = {0.0f, 0.5f, 2.0f, 30.0f, 1000.0f};
  const Vec3 place = origin + extent * samples.point() + samples.direction() * (size * away[samples.below(5)]);
  const Vec3 reach = some_extent(samples, size * std::pow(10.0f, samples.uniform(-3, 1)));
  const Vec3 normal = main_direction(samples);
  const float normal_spread = some_spread(samples);
  const bool in_plane = samples.below(2) == 0, level = samples.below(4) == 0;
  const std::uint32_t point_count = samples.below(4) == 0 ? 1 : 1 + samples.below(64);
  for (std::uint32_t i = 0; i < point_count; ++i) {
    Vec3 offset = reach * samples.point();
    if (in_plane) offset = offset - normal * dot(offset, normal);
    Vec3 p = place + offset;
    if (level) p.y = origin.y;
    if (samples.below(40) == 0) p = c.lights[0].position;
    c.points.push_back({p, spread_about(samples, normal, normal_spread)});
  }
  c.clamp = max_of(size * std::pow(10.0f, samples.uniform(-4, 0)), kSmallestClamp);
  return c;
}

template <class T>
ReceiverGroup<T> group_of(const std::vector<Point>& points) {
  Box box;
  Vec3 sum;
  bool all_same = true;
  for (const Point& p : points) {
    box = extend(box, p.position);
    sum += p.normal;
    all_same = all_same && p.normal == points[0].normal;
  }
  const Vec3 axis = group_axis(sum, points[0].normal, all_same);
  float cosine = 1, gain_lo = kInfinity, gain_hi = kInfinity;
  for (const Point& p : points) {
    cosine = min_of(cosine, group_cosine(axis, p.normal));
    gain_lo = min_of(gain_lo, gap_to_end(-axis, box, p.position));
    gain_hi = min_of(gain_hi, gap_to_end(axis, box, p.position));
  }
  return receiver_group<T>(box, axis, cosine, gain_lo, gain_hi);
}

template <class T>
Vec3T<T> wide(Vec3 v) {
  return {T(v.x), T(v.y), T(v.z)};
}

template <class T>
ClusterBounds<T> bounds_of(const LightCluster& c) {
  return {wide<T>(c.box.lo), wide<T>(c.box.hi), wide<T>(c.cone.axis), T(c.cone.cos_half_angle)};
}

TEST(GroupBound, IsNeverBelowAnyVplAtAnyReceiver) {
  test::LightSamples samples(21);
  int tight = 0;
  for (int round = 0; round < 150000; ++round) {
    const Case c = random_case(samples);
    const LightCluster cluster = test::cluster_of(c.lights);
    const float bound = group_vpl_bound(group_of<float>(c.points), bounds_of<float>(cluster), c.clamp * c.clamp);
    const double in_double =
        group_vpl_bound(group_of<double>(c.points), bounds_of<double>(cluster), static_cast<double>(c.clamp) * c.clamp);
    ASSERT_TRUE(std::isfinite(bound)) << "round " << round;
    double largest = 0;
    for (const Point& p : c.points) {
      for (const Vpl& light : c.lights)
        largest = std::max(largest, oracle::vpl_term(p.position, p.normal, light.position, light.axis, c.clamp));
    }
    ASSERT_GE(bound, largest) << "round " << round << ", " << c.lights.size() << " lights, " << c.points.size();
    ASSERT_GE(in_double, largest) << "round " << round << ", " << c.lights.size() << " lights, " << c.points.size();
    tight += bound <= 1.5 * largest;
  }
  EXPECT_GT(tight, 37000);  // a bound that says "anything" would pass all the above
}

TEST(GroupBound, OfOneReceiverIsThatOfThePoint) {
  test::LightSamples samples(22);
  for (int round = 0; round < 50000; ++round) {
    Case c = random_case(samples);
    c.points.resize(1);
    const LightCluster cluster = test::cluster_of(c.lights);
    const float group = group_vpl_bound(group_of<float>(c.points), bounds_of<float>(cluster), c.clamp * c.clamp);
    const float point =
        vpl_bound<float>({c.points[0].position, c.points[0].normal}, cluster.box, cluster.cone, c.clamp * c.clamp);
    ASSERT_LE(group, point * (1 + 1e-5f)) << "round " << round;
  }
}

TEST(GroupBound, IsNeverBelowAnyPointOrSpotLight) {
  test::LightSamples samples(23);
  for (int round = 0; round < 30000; ++round) {
    const Case c = random_case(samples);
    const std::vector<PointLight> lights = test::lamps_at(c.lights, round % 8 != 0, samples);
    const LightCluster cluster = test::cluster_of(lights);
    const float bound = group_point_bound(group_of<float>(c.points), bounds_of<float>(cluster), c.clamp * c.clamp);
    for (const PointLight& light : lights) {
      for (const Point& p : c.points)
        ASSERT_GE(bound, oracle::point_term(p.position, p.normal, light, c.clamp)) << "round " << round;
    }
  }
}

TEST(GroupBound, IsNeverBelowAnyDirectionalLight) {
  test::LightSamples samples(24);
  for (int round = 0; round < 100000; ++round) {
    const Vec3 around = main_direction(samples), normal = main_direction(samples);
    const float spread = some_spread(samples), normal_spread = some_spread(samples);
    Box box;
    std::vector<Vec3> towards;
    for (std::uint32_t i = 0; i < 1 + samples.below(8); ++i) {
      towards.push_back(spread_about(samples, around, spread));
      box = extend(box, towards.back());
    }
    std::vector<Point> points;
    for (std::uint32_t i = 0; i < 1 + samples.below(8); ++i)
      points.push_back({samples.point(), spread_about(samples, normal, normal_spread)});
    const float bound = group_directional_bound(group_of<float>(points), bounds_of<float>({box, {}, {}, {}, 0}));
    for (const Point& p : points) {
      for (const Vec3 t : towards) {
        const oracle::DoublePoint n(p.normal), w(t);
        const double cosine = (n.x * w.x + n.y * w.y + n.z * w.z) / std::sqrt(w.x * w.x + w.y * w.y + w.z * w.z);
        ASSERT_GE(bound * (1 + 1e-6), cosine) << "round " << round;
      }
    }
  }
}

// What is dark for all must be known to be dark, also where a plane of receivers is slanted and its box is not flat.
TEST(GroupBound, IsZeroWhereNoReceiverIsLit) {
  const LightCluster floor{{{0, 0, 0}, {3, 0, 3}}, {{0, 1, 0}, 1}, {}, {}, 0};
  const auto bound = [&](const std::vector<Point>& points) {
    return group_vpl_bound(group_of<float>(points), bounds_of<float>(floor), 1e-4f);
  };
  const Vec3 up{0, 1, 0}, down{0, -1, 0};
  EXPECT_EQ(bound({{{1, 1, 1}, up}, {{2, 1.5f, 1}, up}}), 0.0f);
  EXPECT_EQ(bound({{{1, -1, 1}, up}, {{2, -1, 1}, down}}), 0.0f);
  EXPECT_GT(bound({{{1, 1, 1}, up}, {{1, 1, 1.1f}, down}}), 0.9f);
  // Receivers on a slope that all lights lie behind; the corner of their box lies in front of some.
  const Vec3 slope = normalize(Vec3{1, 1, 0});
  const LightCluster behind{{{-0.5f, -0.6f, 0}, {-0.4f, -0.5f, 1}}, {{0, 1, 0}, 1}, {}, {}, 0};
  const std::vector<Point> points{{{-1, 1, 0}, slope}, {{1, -1, 1}, slope}};
  EXPECT_EQ(group_vpl_bound(group_of<float>(points), bounds_of<float>(behind), 1e-4f), 0.0f);
}

}  // namespace
}  // namespace lightcuts
