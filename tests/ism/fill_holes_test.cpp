#include "cpu/ism/fill_holes.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/shadow_map.h"
#include "oracle/pull_push_oracle.h"

namespace lightcuts {
namespace {

/// Runs the fast version and the naive one on the same random map; they must agree to the bit.
template <class Depth>
void compare(int size, double filled, int levels, HoleFill fill) {
  std::mt19937 dice(static_cast<unsigned>(size * 100 + levels));
  std::vector<Depth> map(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), kNoDepth<Depth>);
  oracle::Depths expected(static_cast<std::size_t>(size));
  std::uniform_real_distribution<double> unit(0, 1);
  const auto steps = static_cast<double>(kDepthSteps<Depth>);
  for (std::size_t i = 0; i < map.size(); ++i) {
    // Two surfaces, so that thresholds decide something.
    if (unit(dice) < filled)
      map[i] = static_cast<Depth>((unit(dice) < 0.5 ? 0.2 : 0.9) * steps + unit(dice) * 0.08 * steps);
    expected[i / static_cast<std::size_t>(size)].push_back(
        map[i] == kNoDepth<Depth> ? std::nullopt : std::optional<std::uint64_t>(map[i]));
  }
  FillScratch<Depth> scratch;
  fill_holes(map.data(), size, levels, fill, scratch);
  expected = oracle::pull_push(expected, levels, fill == HoleFill::edges,
                               static_cast<std::uint64_t>(kFillThreshold * static_cast<double>(kDepthSteps<Depth>)));
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto& e = expected[i / static_cast<std::size_t>(size)][i % static_cast<std::size_t>(size)];
    ASSERT_EQ(map[i], e ? static_cast<Depth>(*e) : kNoDepth<Depth>)
        << "size " << size << ", levels " << levels << ", texel " << i;
  }
}

TEST(FillHoles, AgreesWithTheNaiveVersionToTheBit) {
  for (const HoleFill fill : {HoleFill::mean, HoleFill::edges}) {
    for (const int size : {1, 2, 3, 5, 7, 16, 17, 31, 33, 64}) {
      for (const double filled : {0.0, 0.05, 0.5, 0.9, 1.0}) {
        for (const int levels : {0, 1, 2, 5, 9}) {
          compare<std::uint16_t>(size, filled, levels, fill);
          compare<std::uint32_t>(size, filled, levels, fill);
        }
      }
    }
  }
}

TEST(FillHoles, TheStudysMeanClosesAHoleInAPlane) {
  std::vector<std::uint16_t> map(64, 1000);
  map[3 * 8 + 3] = kNoDepth<std::uint16_t>;
  FillScratch<std::uint16_t> scratch;
  fill_holes(map.data(), 8, 2, HoleFill::mean, scratch);
  EXPECT_EQ(map, std::vector<std::uint16_t>(64, 1000));
}

TEST(FillHoles, AHoleBesideAnOccluderTakesTheBackground) {
  // Columns: occluder at 1000, a hole, background at 60000.
  std::vector<std::uint16_t> map{1000, 1000,  60000, 60000, 1000, 0xffff, 60000, 60000,
                                 1000, 60000, 60000, 60000, 1000, 1000,   60000, 60000};
  std::vector<std::uint16_t> mean = map;
  FillScratch<std::uint16_t> scratch;
  map[0] = 60000;  // three of four hold a depth, one of them the background's
  fill_holes(map.data(), 4, 1, HoleFill::edges, scratch);
  fill_holes(mean.data(), 4, 1, HoleFill::mean, scratch);
  EXPECT_GT(map[5], 50000);
  EXPECT_EQ(mean[5], 1000);
}

TEST(FillHoles, AnOpeningStaysOpen) {
  // The left half is drawn, the right half is truly empty.
  std::vector<std::uint16_t> map(256, kNoDepth<std::uint16_t>);
  for (std::size_t i = 0; i < 256; ++i) {
    if (i % 16 < 7) map[i] = 500;
  }
  FillScratch<std::uint16_t> scratch;
  const std::vector<std::uint16_t> before = map;
  fill_holes(map.data(), 16, 4, HoleFill::edges, scratch);
  EXPECT_EQ(map, before);
}

}  // namespace
}  // namespace lightcuts
