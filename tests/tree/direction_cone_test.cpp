#include <gtest/gtest.h>

#include <algorithm>

#include "kernels/light_cluster.h"
#include "light_samples.h"

namespace lightcuts {
namespace {

double cosine(Vec3 a, Vec3 b) {
  const double ax = a.x, ay = a.y, az = a.z;
  return (ax * b.x + ay * b.y + az * b.z) /
         std::sqrt((ax * ax + ay * ay + az * az) * (double(b.x) * b.x + double(b.y) * b.y + double(b.z) * b.z));
}

/// A direction inside a cone, often at its rim.
Vec3 inside(const DirectionCone& cone, test::LightSamples& samples) {
  if (cone.cos_half_angle == 1) return cone.axis;
  const double half = std::acos(static_cast<double>(cone.cos_half_angle));
  const double angle = samples.below(2) == 0 ? half * (1 - 1e-6) : half * samples.uniform();
  const Vec3 side = normalize(cross(cone.axis, samples.direction()));
  const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
  const Vec3 n = normalize(cone.axis * c + side * s);
  return cosine(cone.axis, n) >= static_cast<double>(cone.cos_half_angle) ? n : cone.axis;
}

DirectionCone random_cone(test::LightSamples& samples) {
  const float narrow = std::cos(std::pow(10.0f, samples.uniform(-4, 0)));
  const float cosines[4] = {1, narrow, samples.uniform(-1, 1), -1};
  return {samples.direction(), cosines[samples.below(4)]};
}

TEST(DirectionCone, UnionContainsBoth) {
  test::LightSamples samples(21);
  for (int round = 0; round < 1000000; ++round) {
    const DirectionCone p = random_cone(samples);
    DirectionCone q = random_cone(samples);
    if (round % 3 == 0) q.axis = normalize(p.axis + samples.direction() * std::pow(10.0f, samples.uniform(-7, 0)));
    if (round % 7 == 0) q.axis = -p.axis;
    const DirectionCone both = unite(p, q);
    for (const DirectionCone& part : {p, q}) {
      const Vec3 n = inside(part, samples);
      ASSERT_TRUE(n == both.axis || cosine(both.axis, n) >= static_cast<double>(both.cos_half_angle))
          << "round " << round;
    }
  }
}

// Oracle: the textbook union with arc functions in double precision.
TEST(DirectionCone, UnionIsHardlyLargerThanTheSmallestOne) {
  test::LightSamples samples(22);
  for (int round = 0; round < 100000; ++round) {
    const DirectionCone p = random_cone(samples), q = random_cone(samples);
    const double half_p = std::acos(double(p.cos_half_angle)), half_q = std::acos(double(q.cos_half_angle));
    const double between = std::acos(std::clamp(cosine(p.axis, q.axis), -1.0, 1.0));
    const double wide = std::max(half_p, half_q), narrow = std::min(half_p, half_q);
    const double half = between + narrow <= wide ? wide : std::min((between + half_p + half_q) / 2, double(kPi));
    const DirectionCone both = unite(p, q);
    EXPECT_LE(both.cos_half_angle, std::cos(half) + 1e-6) << "round " << round;
    EXPECT_GE(both.cos_half_angle, std::cos(half) - 2e-3) << "round " << round;
    const float metric = united_cosine(p.axis, p.cos_half_angle, detail::sine_of(p.cos_half_angle), q.axis,
                                       q.cos_half_angle, detail::sine_of(q.cos_half_angle));
    EXPECT_NEAR(std::cos(half), metric, 1e-3) << "round " << round;
  }
}

TEST(DirectionCone, UnionOfEqualAxesIsExact) {
  test::LightSamples samples(23);
  const Vec3 axis = samples.direction();
  EXPECT_EQ(unite(DirectionCone{axis, 1}, DirectionCone{axis, 1}).cos_half_angle, 1.0f);
  EXPECT_EQ(unite(DirectionCone{axis, 1}, DirectionCone{axis, 0.25f}).cos_half_angle, 0.25f);
  EXPECT_EQ(united_cosine(axis, 1, 0, axis, 1, 0), 1.0f);
}

}  // namespace
}  // namespace lightcuts
