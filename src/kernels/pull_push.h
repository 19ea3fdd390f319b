#pragma once

#include <cstdint>

#include "kernels/shadow_map.h"
#include "lightcuts/math.h"

namespace lightcuts {

// Fills the holes of a shadow map from its own coarser levels. Depth codes are whole numbers and so are the means: CPU
// and GPU agree to the last bit, in whatever order texels are taken. Reference: 02-algorithms, section 5.

/// The farthest of four depths; 0 where none is present.
template <class Depth>
LC_FN std::uint64_t farthest_depth(const Depth (&depths)[4]) {
  std::uint64_t farthest = 0;
  for (const Depth depth : depths) {
    if (depth != kNoDepth<Depth>) farthest = max_of<std::uint64_t>(farthest, depth);
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
LC_FN Depth pull_texel(Depth a, Depth b, Depth c, Depth d, std::uint64_t threshold, int least) {
  const Depth depths[4] = {a, b, c, d};
  const std::uint64_t farthest = farthest_depth(depths);
  std::uint64_t sum = 0, count = 0;
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

/// Smooth push: an empty texel whose parent holds a depth takes the mean of the four nearest coarse texels, weighted
/// 9 : 3 : 3 : 1, of those that belong to the farthest surface among them.
template <class Depth>
LC_FN Depth push_texel_smooth(Depth fine, Depth parent, Depth beside, Depth above, Depth diagonal,
                              std::uint64_t threshold) {
  if (fine != kNoDepth<Depth> || parent == kNoDepth<Depth>) return fine;
  const Depth depths[4] = {parent, beside, above, diagonal};
  const std::uint64_t weights[4] = {9, 3, 3, 1}, farthest = farthest_depth(depths);
  std::uint64_t sum = 0, weight = 0;
  for (int i = 0; i < 4; ++i) {
    if (depths[i] == kNoDepth<Depth> || depths[i] + threshold < farthest) continue;
    sum += weights[i] * depths[i];
    weight += weights[i];
  }
  return static_cast<Depth>((sum + weight / 2) / weight);
}

}  // namespace lightcuts
