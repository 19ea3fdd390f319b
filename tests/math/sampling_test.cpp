#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "math/chi_square.h"
#include "math/frame.h"
#include "math/sample_stream.h"
#include "math/warp.h"

namespace lightcuts {
namespace {

constexpr std::uint32_t kSamples = 100000;

SampleStream random_stream(std::uint32_t index, std::uint64_t seed = 11) { return {seed, index, false}; }

double turn(double x, double y) { return std::atan2(y, x) / (2 * 3.14159265358979323846) + 0.5; }

TEST(SinCos, AreThoseOfTheLibraryButForRounding) {
  for (int i = -1000; i <= 1000; ++i) {
    const float angle = static_cast<float>(i) / 1000 * (kPi / 4);
    const SinCos small = small_sin_cos(angle);
    EXPECT_NEAR(small.sin, std::sin(static_cast<double>(angle)), 1.2e-7);
    EXPECT_NEAR(small.cos, std::cos(static_cast<double>(angle)), 1.2e-7);
    const float turn = static_cast<float>(i) / 500;  // all quarters, backwards too
    const SinCos any = sin_cos_of_turn(turn);
    EXPECT_NEAR(any.sin, std::sin(2 * 3.14159265358979323846 * static_cast<double>(turn)), 3e-7) << turn;
    EXPECT_NEAR(any.cos, std::cos(2 * 3.14159265358979323846 * static_cast<double>(turn)), 3e-7) << turn;
  }
}

TEST(Warp, DiscIsUniform) {
  std::vector<std::uint64_t> counts(256);
  double mean_r_sq = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Vec2 p = sample_disc(random_stream(i).draw(0).unit2(0));
    const double r_sq = double(p.x) * p.x + double(p.y) * p.y;
    ASSERT_LE(r_sq, 1 + 1e-6);
    mean_r_sq += r_sq / kSamples;
    ++counts[test::cell(r_sq, turn(p.x, p.y), 16)];
  }
  test::expect_uniform(counts);
  EXPECT_NEAR(mean_r_sq, 0.5, 0.005);
}

TEST(Warp, ConcentricMapIsContinuousAndKeepsArea) {
  const Vec2 middle = sample_disc({0.5f, 0.5f});
  EXPECT_EQ(middle.x, 0);
  EXPECT_EQ(middle.y, 0);
  // Steps of 1/512 never jump, over wedge borders neither; the Jacobian is pi everywhere but on the diagonals.
  constexpr int n = 512;
  const auto at = [](int x, int y) { return sample_disc({static_cast<float>(x) / n, static_cast<float>(y) / n}); };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const Vec2 p = at(x, y), right = at(x + 1, y) - p, down = at(x, y + 1) - p;
      EXPECT_LT(std::hypot(right.x, right.y), 3.0 / n);
      EXPECT_LT(std::hypot(down.x, down.y), 3.0 / n);
      const bool diagonal = std::abs(x - y) < 2 || std::abs(x + y - n) < 3;
      if (!diagonal && std::abs(x - n / 2) > 32 && std::abs(y - n / 2) > 32) {
        EXPECT_NEAR(std::fabs(right.x * down.y - right.y * down.x) * n * n, kPi, 0.1) << x << " " << y;
      }
    }
  }
}

TEST(Warp, HemisphereIsCosineDistributed) {
  std::vector<std::uint64_t> counts(256);
  double mean = 0, mean_sq = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Vec3 d = sample_cosine_hemisphere(random_stream(i).draw(1).unit2(0));
    ASSERT_NEAR(length(d), 1, 1e-5);
    mean += double(d.z) / kSamples;
    mean_sq += double(d.z) * d.z / kSamples;
    ++counts[test::cell(double(d.z) * d.z, turn(d.x, d.y), 16)];  // cos^2 is uniform
  }
  test::expect_uniform(counts);
  EXPECT_NEAR(mean, 2.0 / 3, 0.003);
  EXPECT_NEAR(mean_sq, 0.5, 0.003);
}

TEST(Warp, TriangleIsUniform) {
  // Cells u, v of an 8 x 8 grid; those on the hypotenuse are half as large.
  std::vector<std::uint64_t> counts(64);
  std::vector<double> expected(64, 0);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x + y < 8; ++x) expected[8 * y + x] = x + y == 7 ? 1 / 64.0 : 2 / 64.0;
  }
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Vec2 b = sample_triangle(random_stream(i).draw(2).unit2(1));
    ASSERT_GE(b.x, 0);
    ASSERT_GE(b.y, 0);
    ASSERT_LE(b.x + b.y, 1 + 1e-6);
    ++counts[test::cell(b.x, b.y, 8)];
  }
  test::expect_distribution(counts, expected);
}

TEST(Warp, SphereIsUniform) {
  std::vector<std::uint64_t> counts(256);
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Vec3 d = sample_sphere(random_stream(i).draw(3).unit2(2));
    ASSERT_NEAR(length(d), 1, 1e-5);
    ++counts[test::cell(0.5 + 0.5 * d.z, turn(d.x, d.y), 16)];
  }
  test::expect_uniform(counts);
}

TEST(Frame, IsOrthonormalAndRightHandedEverywhere) {
  std::vector<Vec3> normals{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}, {0, 0, -0.0f}};
  normals.back() = normalize(Vec3{1e-4f, -1e-4f, -1});
  for (std::uint32_t i = 0; i < 1000; ++i) normals.push_back(sample_sphere(random_stream(i).draw(0).unit2(0)));
  for (const Vec3 n : normals) {
    const Frame f = make_frame(n);
    EXPECT_NEAR(length(f.x), 1, 1e-5);
    EXPECT_NEAR(length(f.y), 1, 1e-5);
    EXPECT_NEAR(dot(f.x, f.y), 0, 1e-5);
    EXPECT_NEAR(dot(f.x, n), 0, 1e-5);
    EXPECT_NEAR(length(cross(f.x, f.y) - n), 0, 1e-5);
  }
}

TEST(Philox, MatchesItsPublishedVectors) {
  const Sample4 s = philox(0, 0, 0, 0);  // Random123's known answers for philox4x32-10
  EXPECT_EQ(s.bits[0], 0x6627e8d5u);
  EXPECT_EQ(s.bits[1], 0xe169c58du);
  EXPECT_EQ(s.bits[2], 0xbc57ac4cu);
  EXPECT_EQ(s.bits[3], 0x9b00dbd8u);
}

/// Pairs that ought to be independent fill the square evenly: dimensions, groups, neighbouring streams, seeds.
TEST(SampleStream, RandomNumbersAreIndependent) {
  std::vector<std::vector<std::uint64_t>> pairs(5, std::vector<std::uint64_t>(256));
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Sample4 a = random_stream(i).draw(0), b = random_stream(i).draw(1), next = random_stream(i + 1).draw(0);
    const Sample4 seeded = random_stream(i, 12).draw(0), derived = random_stream(i, derive_seed(11, 1)).draw(0);
    ++pairs[0][test::cell(a.unit(0), a.unit(1), 16)];
    ++pairs[1][test::cell(a.unit(2), b.unit(2), 16)];
    ++pairs[2][test::cell(a.unit(3), next.unit(3), 16)];
    ++pairs[3][test::cell(a.unit(0), seeded.unit(0), 16)];
    ++pairs[4][test::cell(a.unit(1), derived.unit(1), 16)];
  }
  for (const auto& counts : pairs) test::expect_uniform(counts);
}

TEST(SampleStream, UnitsStayBelowOne) {
  const Sample4 most{{0xffffffffu, 0xffffffffu, 0xffffffffu, 0xffffffffu}};
  EXPECT_LT(most.unit(0), 1.0f);
  EXPECT_LT(most.unit_double(0), 1.0);
}

TEST(SampleStream, SobolStratifiesEveryDimensionOfEveryGroup) {
  for (const std::uint64_t seed : {1u, 2u}) {
    for (std::uint32_t group = 0; group < 6; ++group) {
      for (int d = 0; d < 4; ++d) {
        for (const std::uint32_t first : {0u, 1024u, 5u * 1024u}) {  // any aligned block, not only the first
          std::set<std::uint32_t> strata;
          for (std::uint32_t i = 0; i < 1024; ++i) {
            strata.insert(SampleStream{seed, first + i, true}.draw(group).bits[d] >> 22);
          }
          EXPECT_EQ(strata.size(), 1024u) << "group " << group << " dimension " << d;
        }
      }
    }
  }
}

TEST(SampleStream, SobolPairsAreNets) {
  // Dimensions 0 and 1: one of 256 points in every elementary box of area 1/256, whatever its shape.
  for (std::uint32_t group = 0; group < 4; ++group) {
    for (std::uint32_t wide = 0; wide <= 8; ++wide) {
      std::set<std::uint32_t> boxes;
      for (std::uint32_t i = 0; i < 256; ++i) {
        const Sample4 s = SampleStream{7, i, true}.draw(group);
        const std::uint32_t x = wide == 0 ? 0 : s.bits[0] >> (32 - wide), y = wide == 8 ? 0 : s.bits[1] >> (24 + wide);
        boxes.insert(x << 8 | y);
      }
      EXPECT_EQ(boxes.size(), 256u) << "group " << group << " shape " << wide;
    }
  }
}

TEST(SampleStream, SobolGroupsAndSeedsDoNotCorrelate) {
  std::vector<std::vector<std::uint64_t>> pairs(4, std::vector<std::uint64_t>(256));
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Sample4 a = SampleStream{3, i, true}.draw(0), b = SampleStream{3, i, true}.draw(1);
    const Sample4 c = SampleStream{3, i, true}.draw(5), other = SampleStream{4, i, true}.draw(0);
    ++pairs[0][test::cell(a.unit(0), b.unit(0), 16)];
    ++pairs[1][test::cell(a.unit(2), c.unit(3), 16)];
    ++pairs[2][test::cell(a.unit(0), other.unit(0), 16)];
    ++pairs[3][test::cell(b.unit(1), c.unit(1), 16)];
  }
  for (const auto& counts : pairs) test::expect_uniform(counts);
}

TEST(SampleStream, SobolIntegratesBetterThanChance) {
  // Mean of a smooth function of four dimensions: the error of 1024 points against its known integral.
  double sobol = 0, random = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool low_discrepancy : {true, false}) {
      double mean = 0;
      for (std::uint32_t i = 0; i < 1024; ++i) {
        const Sample4 s = SampleStream{seed, i, low_discrepancy}.draw(2);
        mean += std::exp(-s.unit(0) - s.unit(1) - s.unit(2) - s.unit(3)) / 1024;
      }
      const double error = mean - std::pow(1 - std::exp(-1.0), 4);
      (low_discrepancy ? sobol : random) += error * error / 20;
    }
  }
  EXPECT_LT(std::sqrt(sobol), std::sqrt(random) / 10);
}

}  // namespace
}  // namespace lightcuts
