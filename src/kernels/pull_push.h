#pragma once

#include <cstdint>

#include "kernels/shadow_map.h"
#include "lightcuts/math.h"

namespace lightcuts {

// Fills the holes of a shadow map from its own coarser levels. Depth codes are whole numbers and so are the means: CPU
// and GPU agree to the last bit, in whatever order texels are taken. Codes have 24 bits at most, so that sums and
// thresholds fit into 32. Reference: 02-algorithms, section 5.

/// How far behind the nearest of four texels another may lie to be averaged with it, as a share of all depths, at the finest
/// level; it doubles with each level, as the texels do. A twentieth: Ritschel et al. 2008.
inline constexpr double kFillThreshold = 0.05;
/// How many of four texels must hold a depth for their coarser texel to hold one, where surfaces are kept apart.
inline constexpr int kFillLeast = 3;

/// What the texels of one level are combined by.
struct FillRule {
  bool keeps_surfaces_apart;  ///< false: the study's mean of all valid texels
  std::uint32_t threshold;    ///< in depth codes
  int least;                  ///< texels that must hold a depth
};

/// The rule between level `level` (0: the finest) and the next coarser one.
template <class Depth>
LC_FN FillRule fill_rule(bool keeps_surfaces_apart, int level) {
  if (!keeps_surfaces_apart) return {false, 1u << 26, 1};
  const auto finest = static_cast<std::uint32_t>(kFillThreshold * static_cast<double>(kDepthSteps<Depth>));
  return {true, finest << min_of(level, 8), kFillLeast};
}

/// The farthest of four depths; 0 where none is present.
template <class Depth>
LC_FN std::uint32_t farthest_depth(const Depth (&depths)[4]) {
  std::uint32_t farthest = 0;
  for (const Depth depth : depths) {
    if (depth != kNoDepth<Depth>) farthest = max_of<std::uint32_t>(farthest, depth);
  }
  return farthest;
}

/// Combines the four texels of the finer level, absent ones being kNoDepth.
///
/// Texels more than `threshold` in front of the farthest one belong to another surface and are left out: a hole beside a
/// shadow's edge takes the background, so that occluders do not grow. Where fewer than `least` hold a depth the result
/// is absent: at an opening's border, where there is truly nothing, little is closed. With the largest threshold and
/// `least` 1 this is the study's mean of all valid texels.
template <class Depth>
LC_FN Depth pull_texel(Depth a, Depth b, Depth c, Depth d, std::uint32_t threshold, int least) {
  const Depth depths[4] = {a, b, c, d};
  const std::uint32_t farthest = farthest_depth(depths);
  std::uint32_t sum = 0, count = 0;
  int present = 0;
  for (const Depth depth : depths) {
    if (depth == kNoDepth<Depth>) continue;
    ++present;
    if (depth + threshold < farthest) continue;
    sum += depth;
    ++count;
  }
  if (present < least) return kNoDepth<Depth>;
  return static_cast<Depth>((sum + count / 2) / count);
}

/// The study's push: an empty texel takes its parent's value.
template <class Depth>
LC_FN Depth push_texel(Depth fine, Depth parent) {
  return fine == kNoDepth<Depth> ? parent : fine;
}

/// An empty texel whose parent holds a depth takes the farthest of the four nearest coarse texels, as far as they hold any.
/// Holes gape where surfaces meet, in corners and beside edges: a mean would stand before both.
template <class Depth>
LC_FN Depth push_texel_farthest(Depth fine, Depth parent, Depth beside, Depth above, Depth diagonal) {
  if (fine != kNoDepth<Depth> || parent == kNoDepth<Depth>) return fine;
  const Depth depths[4] = {parent, beside, above, diagonal};
  return static_cast<Depth>(farthest_depth(depths));
}

/// The coarse texel (x, y) of a level; `at(i, j)` reads the finer level and gives kNoDepth outside.
template <class Depth, class Fine>
LC_FN Depth pull_at(int x, int y, const FillRule& rule, const Fine& at) {
  return pull_texel<Depth>(at(2 * x, 2 * y), at(2 * x + 1, 2 * y), at(2 * x, 2 * y + 1), at(2 * x + 1, 2 * y + 1),
                           rule.threshold, rule.least);
}

/// What the empty fine texel (x, y) takes; `at(i, j)` reads the coarser level and gives kNoDepth outside.
template <class Depth, class Coarse>
LC_FN Depth push_at(int x, int y, const FillRule& rule, const Coarse& at) {
  const int px = x / 2, py = y / 2;
  if (!rule.keeps_surfaces_apart) return at(px, py);
  const int beside_x = px + (x % 2 == 0 ? -1 : 1), beside_y = py + (y % 2 == 0 ? -1 : 1);
  return push_texel_farthest<Depth>(kNoDepth<Depth>, at(px, py), at(beside_x, py), at(px, beside_y),
                                    at(beside_x, beside_y));
}

}  // namespace lightcuts
