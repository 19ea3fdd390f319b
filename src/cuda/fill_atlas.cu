#include "cuda/fill_atlas.h"

#include <algorithm>
#include <vector>

#include "kernels/pull_push.h"

namespace lightcuts::cuda {
namespace {

using Code = std::uint16_t;

constexpr int kThreads = 256;
constexpr int kBlocksPerMultiprocessor = 8;

/// A square level of the texture; whatever lies outside is empty.
struct AtlasLevel {
  Code* codes;
  int size;
  LC_KERNEL Code* row(int y) const { return codes + static_cast<std::size_t>(y) * static_cast<std::size_t>(size); }
  LC_KERNEL Code operator()(int x, int y) const {
    return x >= 0 && y >= 0 && x < size && y < size ? row(y)[x] : kNoDepth<Code>;
  }
};

__global__ void __launch_bounds__(kThreads) pull_kernel(AtlasLevel fine, AtlasLevel coarse, FillRule rule) {
  for (int y = static_cast<int>(blockIdx.x); y < coarse.size; y += static_cast<int>(gridDim.x)) {
    for (int x = static_cast<int>(threadIdx.x); x < coarse.size; x += kThreads) {
      coarse.row(y)[x] = pull_at<Code>(x, y, rule, fine);
    }
  }
}

__global__ void __launch_bounds__(kThreads) push_kernel(AtlasLevel coarse, AtlasLevel fine, FillRule rule) {
  for (int y = static_cast<int>(blockIdx.x); y < fine.size; y += static_cast<int>(gridDim.x)) {
    for (int x = static_cast<int>(threadIdx.x); x < fine.size; x += kThreads) {
      if (fine.row(y)[x] == kNoDepth<Code>) fine.row(y)[x] = push_at<Code>(x, y, rule, coarse);
    }
  }
}

/// A square of 4 x 4 texels in registers.
struct Square {
  Code at[4][4];

  __device__ bool full() const {
    bool full = true;
    for (int i = 0; i < 16; ++i) full = full && at[i / 4][i % 4] != kNoDepth<Code>;
    return full;
  }

  /// Fills what its 2 x 2 means, and the mean of these, can fill.
  __device__ void fill(const FillRule& first, const FillRule& second) {
    Code mean[2][2];
    for (int i = 0; i < 4; ++i) {
      const int x = i % 2, y = i / 2;
      mean[y][x] = pull_texel<Code>(at[2 * y][2 * x], at[2 * y][2 * x + 1], at[2 * y + 1][2 * x],
                                    at[2 * y + 1][2 * x + 1], first.threshold, first.least);
    }
    const Code all = pull_texel<Code>(mean[0][0], mean[0][1], mean[1][0], mean[1][1], second.threshold, second.least);
    for (int i = 0; i < 16; ++i) {
      Code& texel = at[i / 4][i % 4];
      texel = push_texel(texel, push_texel(mean[i / 8][i % 4 / 2], all));
    }
  }
};

/// One thread a square; `Whole`: the size is divisible by four, so rows of a square are one load.
template <bool Whole>
__global__ void __launch_bounds__(kThreads) fill_squares_kernel(AtlasLevel atlas, FillRule first, FillRule second) {
  const int x = 4 * static_cast<int>(blockIdx.x * kThreads + threadIdx.x), y = 4 * static_cast<int>(blockIdx.y);
  if (x >= atlas.size) return;
  Square square;
  for (int j = 0; j < 4; ++j) {
    if constexpr (Whole) {
      const ushort4 four = *reinterpret_cast<const ushort4*>(atlas.row(y + j) + x);
      square.at[j][0] = four.x, square.at[j][1] = four.y, square.at[j][2] = four.z, square.at[j][3] = four.w;
    } else {
      for (int i = 0; i < 4; ++i) square.at[j][i] = atlas(x + i, y + j);
    }
  }
  if (square.full()) return;
  square.fill(first, second);
  for (int j = 0; j < 4; ++j) {
    if constexpr (Whole) {
      *reinterpret_cast<ushort4*>(atlas.row(y + j) + x) = {square.at[j][0], square.at[j][1], square.at[j][2],
                                                           square.at[j][3]};
    } else {
      for (int i = 0; i < 4; ++i) {
        if (x + i < atlas.size && y + j < atlas.size) atlas.row(y + j)[x + i] = square.at[j][i];
      }
    }
  }
}

}  // namespace

std::uint64_t atlas_scratch(int size, int levels) {
  std::uint64_t codes = 0;
  for (int level = 0; level < levels && size > 1; ++level) {
    size = (size + 1) / 2;
    codes += static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size);
  }
  return codes;
}

void fill_atlas(Device& device, std::uint16_t* atlas, int size, int levels, HoleFill fill, std::uint16_t* coarser) {
  const bool apart = fill == HoleFill::edges;
  const auto most = static_cast<unsigned>(device.multiprocessors() * kBlocksPerMultiprocessor);
  std::vector<AtlasLevel> pyramid{{atlas, size}};
  const auto grid = [&](const AtlasLevel& level) { return std::min(most, static_cast<unsigned>(level.size)); };
  for (int level = 0; level < levels && pyramid.back().size > 1; ++level) {
    const AtlasLevel fine = pyramid.back(), coarse{coarser, (fine.size + 1) / 2};
    coarser += static_cast<std::size_t>(coarse.size) * static_cast<std::size_t>(coarse.size);
    pull_kernel<<<grid(coarse), kThreads, 0, device.stream()>>>(fine, coarse, fill_rule<Code>(apart, level));
    pyramid.push_back(coarse);
  }
  for (std::size_t level = pyramid.size() - 1; level > 0; --level) {
    push_kernel<<<grid(pyramid[level - 1]), kThreads, 0, device.stream()>>>(
        pyramid[level], pyramid[level - 1], fill_rule<Code>(apart, static_cast<int>(level) - 1));
  }
  check(cudaGetLastError(), "filling holes");
}

void fill_atlas_at_once(Device& device, std::uint16_t* atlas, int size) {
  if (size <= 0) return;
  const int squares = (size + 3) / 4;
  const dim3 grid(static_cast<unsigned>((squares + kThreads - 1) / kThreads), static_cast<unsigned>(squares));
  const FillRule first = fill_rule<Code>(false, 0), second = fill_rule<Code>(false, 1);
  if (size % 4 == 0) {
    fill_squares_kernel<true><<<grid, kThreads, 0, device.stream()>>>({atlas, size}, first, second);
  } else {
    fill_squares_kernel<false><<<grid, kThreads, 0, device.stream()>>>({atlas, size}, first, second);
  }
  check(cudaGetLastError(), "filling holes");
}

}  // namespace lightcuts::cuda
