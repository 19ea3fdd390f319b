#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace lightcuts::oracle {

/// A square picture of depths, as text-book pull-push sees it: a place holds a depth or nothing.
using Depths = std::vector<std::vector<std::optional<std::uint64_t>>>;

inline std::optional<std::uint64_t> depth_at(const Depths& d, int x, int y) {
  const int n = static_cast<int>(d.size());
  if (x < 0 || y < 0 || x >= n || y >= n) return std::nullopt;
  return d[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
}

/// Mean, halves rounded up, of the depths that are at most `threshold` nearer than the farthest.
inline std::optional<std::uint64_t> mean_of(const std::vector<std::optional<std::uint64_t>>& all,
                                            std::uint64_t threshold) {
  std::uint64_t farthest = 0, sum = 0, count = 0;
  for (const auto& depth : all) farthest = std::max(farthest, depth.value_or(0));
  for (const auto& depth : all) {
    if (!depth || *depth + threshold < farthest) continue;
    sum += *depth;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return (2 * sum + count) / (2 * count);
}

/// Fills holes by definition, level by level. `edges`: the variant that keeps surfaces apart.
inline Depths pull_push(Depths fine, int levels, bool edges, std::uint64_t threshold) {
  const int n = static_cast<int>(fine.size());
  if (levels == 0 || n <= 1) return fine;
  const int half = (n + 1) / 2;
  Depths coarse(static_cast<std::size_t>(half),
                std::vector<std::optional<std::uint64_t>>(static_cast<std::size_t>(half)));
  for (int y = 0; y < half; ++y) {
    for (int x = 0; x < half; ++x) {
      std::vector<std::optional<std::uint64_t>> four;
      int present = 0;
      for (int k = 0; k < 4; ++k) {
        four.push_back(depth_at(fine, 2 * x + k % 2, 2 * y + k / 2));
        present += four.back() ? 1 : 0;
      }
      if (present < (edges ? 3 : 1)) continue;
      coarse[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] =
          mean_of(four, edges ? threshold : std::uint64_t{1} << 40);
    }
  }
  coarse = pull_push(coarse, levels - 1, edges, 2 * threshold);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      auto& texel = fine[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
      const std::optional<std::uint64_t> parent = depth_at(coarse, x / 2, y / 2);
      if (texel || !parent) continue;
      const int bx = x / 2 + (x % 2 == 1 ? 1 : -1), by = y / 2 + (y % 2 == 1 ? 1 : -1);
      texel = parent;
      for (const auto& near : {depth_at(coarse, bx, y / 2), depth_at(coarse, x / 2, by), depth_at(coarse, bx, by)}) {
        if (edges && near) texel = std::max(*texel, *near);
      }
    }
  }
  return fine;
}

}  // namespace lightcuts::oracle
