#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace lightcuts::test {

/// How many standard deviations Pearson's statistic of these counts lies above what chance gives, by the cube-root
/// approximation of Wilson and Hilferty. `expected` are shares that sum to 1.
inline double chi_square_deviations(const std::vector<std::uint64_t>& counts, const std::vector<double>& expected) {
  double total = 0, statistic = 0;
  for (const std::uint64_t c : counts) total += static_cast<double>(c);
  int used = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double e = expected[i] * total;
    if (e == 0) {
      EXPECT_EQ(counts[i], 0u) << "cell " << i << " has no probability";
      continue;
    }
    EXPECT_GE(e, 2) << "cell " << i << " is too small for the test";
    statistic += (static_cast<double>(counts[i]) - e) * (static_cast<double>(counts[i]) - e) / e;
    ++used;
  }
  const double k = used - 1;
  return (std::cbrt(statistic / k) - (1 - 2 / (9 * k))) / std::sqrt(2 / (9 * k));
}

/// Fails once in some ten thousand where the samples follow the distribution. The seeds are fixed, so never by chance.
inline void expect_distribution(const std::vector<std::uint64_t>& counts, const std::vector<double>& expected) {
  EXPECT_LT(chi_square_deviations(counts, expected), 3.8);
}
inline void expect_uniform(const std::vector<std::uint64_t>& counts) {
  expect_distribution(counts, std::vector<double>(counts.size(), 1.0 / static_cast<double>(counts.size())));
}

/// Cell of a grid of n x n over the unit square.
inline std::size_t cell(double x, double y, int n) {
  const auto clamp_cell = [n](double v) {
    const int i = static_cast<int>(v * n);
    return static_cast<std::size_t>(i < 0 ? 0 : i >= n ? n - 1 : i);
  };
  return clamp_cell(y) * static_cast<std::size_t>(n) + clamp_cell(x);
}

}  // namespace lightcuts::test
