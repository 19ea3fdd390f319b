#pragma once

#include <cstdint>

#include "kernels/pull_push.h"
#include "lightcuts/math.h"

// Filling a map's holes by one block of threads: pull and push over coarser levels, as kernels/pull_push.h defines them.

namespace lightcuts::cuda {

/// A level of a map's pyramid, 2^bits texels a side; whatever lies outside is empty.
template <class Depth, class Word>
struct Level {
  Word* codes;
  int bits;
  __device__ int size() const { return 1 << bits; }
  __device__ int count() const { return 1 << 2 * bits; }
  LC_KERNEL Depth operator()(int x, int y) const {
    const bool inside = static_cast<unsigned>(x | y) < 1u << bits;
    return inside ? static_cast<Depth>(codes[(y << bits) + x]) : kNoDepth<Depth>;
  }
};

template <class Depth, class Fine, class Coarse>
__device__ inline void pull_level(const Fine& fine, const Coarse& coarse, const FillRule& rule, int threads) {
  const int count = coarse.count();
  for (int i = static_cast<int>(threadIdx.x); i < count; i += threads) {
    coarse.codes[i] = pull_at<Depth>(i & (coarse.size() - 1), i >> coarse.bits, rule, fine);
  }
  __syncthreads();
}

template <class Depth, class Coarse, class Fine>
__device__ inline void push_level(const Coarse& coarse, const Fine& fine, const FillRule& rule, int threads) {
  const int count = fine.count();
  for (int i = static_cast<int>(threadIdx.x); i < count; i += threads) {
    if (static_cast<Depth>(fine.codes[i]) == kNoDepth<Depth>) {
      fine.codes[i] = push_at<Depth>(i & (fine.size() - 1), i >> fine.bits, rule, coarse);
    }
  }
  __syncthreads();
}

/// Fills the holes of the map in `codes` with the help of `coarser`, room for all its coarser levels.
template <class Depth>
__device__ inline void fill_map(std::uint32_t* codes, Depth* coarser, int bits, int levels, bool apart, int threads) {
  if (levels <= 0 || bits == 0) return;
  const Level<Depth, std::uint32_t> finest{codes, bits};
  const auto coarse_level = [&](int level) {
    Depth* at = coarser;
    for (int l = 1; l < level; ++l) at += 1 << 2 * (bits - l);
    return Level<Depth, Depth>{at, bits - level};
  };
  int deepest = 1;
  pull_level<Depth>(finest, coarse_level(1), fill_rule<Depth>(apart, 0), threads);
  for (; deepest < levels && deepest < bits; ++deepest) {
    pull_level<Depth>(coarse_level(deepest), coarse_level(deepest + 1), fill_rule<Depth>(apart, deepest), threads);
  }
  for (int level = deepest; level > 1; --level) {
    push_level<Depth>(coarse_level(level), coarse_level(level - 1), fill_rule<Depth>(apart, level - 1), threads);
  }
  push_level<Depth>(coarse_level(1), finest, fill_rule<Depth>(apart, 0), threads);
}

// --- Maps of 32x32 texels and 16 bits, two levels deep, by 128 threads, each with two rows of four texels in registers ---

inline constexpr int kSmallMap = 32, kSmallMapThreads = 128;

/// The coarser levels of such a map, with a border of empty texels.
struct SmallPyramid {
  static constexpr int kStride1 = kSmallMap / 2 + 2, kStride2 = kSmallMap / 4 + 2;
  std::uint16_t level1[kStride1 * kStride1], level2[kStride2 * kStride2];

  __device__ void clear_border() {
    const int i = static_cast<int>(threadIdx.x);
    if (i < kStride1) clear_border(level1, kStride1, i);
    if (i >= 32 && i - 32 < kStride2) clear_border(level2, kStride2, i - 32);
  }
  __device__ static void clear_border(std::uint16_t* codes, int stride, int i) {
    constexpr std::uint16_t kEmpty = kNoDepth<std::uint16_t>;
    codes[i] = kEmpty;
    codes[(stride - 1) * stride + i] = kEmpty;
    codes[i * stride] = kEmpty;
    codes[i * stride + stride - 1] = kEmpty;
  }
};

/// What an empty texel takes from its parent and those beside it; all of a coarser level.
__device__ inline std::uint16_t pushed(std::uint16_t parent, std::uint16_t beside, std::uint16_t above,
                                       std::uint16_t diagonal, const FillRule& rule) {
  if (!rule.keeps_surfaces_apart) return parent;
  return push_texel_farthest<std::uint16_t>(kNoDepth<std::uint16_t>, parent, beside, above, diagonal);
}

/// Fills the holes of a map by two levels, each thread those of its texels: columns 4 (t % 8) and on of rows 2 (t / 8) and on.
__device__ inline void fill_small_map(std::uint16_t (&fine)[2][4], SmallPyramid& pyramid, bool apart) {
  using Code = std::uint16_t;
  constexpr Code kEmpty = kNoDepth<Code>;
  constexpr int kStride1 = SmallPyramid::kStride1, kStride2 = SmallPyramid::kStride2;
  const int column = static_cast<int>(threadIdx.x % 8), row = static_cast<int>(threadIdx.x / 8);
  const FillRule rule0 = fill_rule<Code>(apart, 0), rule1 = fill_rule<Code>(apart, 1);
  pyramid.clear_border();
  Code own[2], other[2];
#pragma unroll
  for (int c = 0; c < 2; ++c) {
    own[c] = pull_texel<Code>(fine[0][2 * c], fine[0][2 * c + 1], fine[1][2 * c], fine[1][2 * c + 1], rule0.threshold,
                              rule0.least);
    other[c] = static_cast<Code>(__shfl_xor_sync(0xffffffffu, static_cast<unsigned>(own[c]), 8));
  }
  Code* const level2 = pyramid.level2 + (row / 2 + 1) * kStride2 + column + 1;
  if (row % 2 == 0) {
    *level2 = pull_texel<Code>(own[0], own[1], other[0], other[1], rule1.threshold, rule1.least);
  }
  __syncthreads();
  Code* const level1 = pyramid.level1 + (row + 1) * kStride1 + 2 * column + 1;
#pragma unroll
  for (int c = 0; c < 2; ++c) {
    if (own[c] == kEmpty) {
      const int beside = c == 0 ? -1 : 1, above = row % 2 == 0 ? -kStride2 : kStride2;
      own[c] = pushed(level2[0], level2[beside], level2[above], level2[above + beside], rule1);
    }
    level1[c] = own[c];
  }
  __syncthreads();
#pragma unroll
  for (int c = 0; c < 2; ++c) {
    if (own[c] == kEmpty) continue;
#pragma unroll
    for (int i = 2 * c; i < 2 * c + 2; ++i) {
      const int beside = i % 2 == 0 ? c - 1 : c + 1;
#pragma unroll
      for (int j = 0; j < 2; ++j) {
        if (fine[j][i] != kEmpty) continue;
        const int above = j == 0 ? -kStride1 : kStride1;
        fine[j][i] = pushed(own[c], level1[beside], level1[above + c], level1[above + beside], rule0);
      }
    }
  }
}

/// Writes such a map.
__device__ inline void write_small_map(const std::uint16_t (&fine)[2][4], std::uint16_t* out) {
  auto* const words = reinterpret_cast<uint2*>(out) + threadIdx.x % 8 + threadIdx.x / 8 * (kSmallMap / 2);
  const auto pair = [](std::uint16_t lo, std::uint16_t hi) { return lo | static_cast<std::uint32_t>(hi) << 16; };
#pragma unroll
  for (int j = 0; j < 2; ++j) words[j * (kSmallMap / 4)] = {pair(fine[j][0], fine[j][1]), pair(fine[j][2], fine[j][3])};
}

/// Writes the map, 4 bytes a thread at a time.
template <class Depth>
__device__ inline void write_map(const std::uint32_t* codes, std::uint32_t texels, Depth* out, std::uint32_t threads) {
  auto* const words = reinterpret_cast<std::uint32_t*>(out);
  if constexpr (sizeof(Depth) == 2) {
    for (std::uint32_t i = threadIdx.x; i < texels / 2; i += threads) {
      words[i] = codes[2 * i] | codes[2 * i + 1] << 16;
    }
  } else {
    for (std::uint32_t i = threadIdx.x; i < texels; i += threads) words[i] = codes[i];
  }
}

}  // namespace lightcuts::cuda
