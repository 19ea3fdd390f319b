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
