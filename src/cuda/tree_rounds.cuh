#pragma once

#include <type_traits>

#include "backend/build_light_tree.h"
#include "cuda/executor.cuh"

namespace lightcuts::cuda {

/// What lights have in common, as words whose order is that of the floats, so that the largest of all is found by atomics
/// in any order. The box's lower corner is kept as that of its negative.
struct SummaryWords {
  static constexpr int kCount = 7;
  std::uint32_t word[kCount];
  std::uint32_t blocks_done;

  __device__ static std::uint32_t ordered(float v) {
    const std::uint32_t bits = __float_as_uint(v);
    return bits >> 31 != 0 ? ~bits : bits | 0x80000000u;
  }
  __device__ static float value(std::uint32_t word) {
    return __uint_as_float(word >> 31 != 0 ? word & 0x7fffffffu : ~word);
  }
};

template <class Light>
__global__ void __launch_bounds__(kBlockThreads)
    summarise_kernel(const Light* lights, std::uint32_t count, SummaryWords* words, LightSummary* summary) {
  std::uint32_t most[SummaryWords::kCount] = {};
#pragma unroll 4
  for (std::uint32_t i = blockIdx.x * kBlockThreads + threadIdx.x; i < count; i += gridDim.x * kBlockThreads) {
    const LightNode leaf = leaf_of(lights[i], i);
    const float values[SummaryWords::kCount] = {-leaf.box.lo.x, -leaf.box.lo.y, -leaf.box.lo.z,           leaf.box.hi.x,
                                                leaf.box.hi.y,  leaf.box.hi.z,  luminance(leaf.intensity)};
#pragma unroll
    for (int k = 0; k < SummaryWords::kCount; ++k) most[k] = max(most[k], SummaryWords::ordered(values[k]));
  }
  __shared__ std::uint32_t of_warp[SummaryWords::kCount][kBlockThreads / 32];
  __shared__ bool last;
#pragma unroll
  for (int k = 0; k < SummaryWords::kCount; ++k) {
#pragma unroll
    for (int step = 16; step > 0; step /= 2) most[k] = max(most[k], __shfl_xor_sync(0xffffffffu, most[k], step));
    if (threadIdx.x % 32 == 0) of_warp[k][threadIdx.x / 32] = most[k];
  }
  __syncthreads();
  // An atomic a block and word: they all queue for one line of memory.
  if (threadIdx.x < SummaryWords::kCount) {
    std::uint32_t all = 0;
    for (const std::uint32_t word : of_warp[threadIdx.x]) all = max(all, word);
    atomicMax(words->word + threadIdx.x, all);
  }
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) last = atomicAdd(&words->blocks_done, 1u) + 1 == gridDim.x;
  __syncthreads();
  if (!last || threadIdx.x != 0) return;
  float v[SummaryWords::kCount];
#pragma unroll
  for (int k = 0; k < SummaryWords::kCount; ++k) v[k] = SummaryWords::value(atomicMax(words->word + k, 0u));
  *summary = {{{-v[0], -v[1], -v[2]}, {v[3], v[4], v[5]}}, max_of(v[6], 0.0f)};
}

/// Builds light trees without asking the device how far it is: a launch for each pass over the tiles, and one that puts all
/// nodes where they belong.
class TreeExecutor : public CudaExecutor {
 public:
  using CudaExecutor::CudaExecutor;

  template <class Light>
  void summarise(const Light* lights, std::uint32_t count, LightSummary* summary) {
    Buffer<SummaryWords> words(device(), 1);
    words.fill_bytes(0);
    const std::uint32_t wanted = (count + kBlockThreads - 1) / kBlockThreads;
    const auto most = static_cast<std::uint32_t>(4 * device().multiprocessors());
    summarise_kernel<<<min_of(wanted, most), kBlockThreads, 0, device().stream()>>>(lights, count, words.data(),
                                                                                    summary);
    check(cudaGetLastError(), "summarising lights");
  }

  /// Sorts words by their bits from `begin` to before `end`; equal ones keep their order.
  void sort_words(Buffer<std::uint64_t>& words, int begin, int end) {
    Buffer<std::uint64_t> other(device(), words.size());
    cub::DoubleBuffer<std::uint64_t> pair(words.data(), other.data());
    std::size_t bytes = 0;
    const auto count = static_cast<std::uint32_t>(words.size());
    check(cub::DeviceRadixSort::SortKeys(nullptr, bytes, pair, count, begin, end, device().stream()),
          "planning a sort");
    Buffer<std::uint8_t> scratch(device(), bytes);
    check(cub::DeviceRadixSort::SortKeys(scratch.data(), bytes, pair, count, begin, end, device().stream()), "sorting");
    if (pair.Current() != words.data()) std::swap(words, other);
  }

  /// Makes the leaves and merges those of each tile, as detail::MakeLeaves and detail::MergeTile do.
  template <class Light>
  void merge_leaves(const detail::MakeLeaves<Light>& make, const detail::TilePass& pass) {
    if constexpr (std::is_same_v<Light, Vpl>) {
      if (fills_the_device(pass)) return merge_many_leaves(make, pass);
    }
    for_each(pass.count, make);
    merge_leaf_tiles(pass);
  }

  /// Merges the clusters of all tiles of a later pass.
  void merge_tiles(const detail::TilePass& pass);

  /// Writes the nodes of a tree of several lights where they belong, as detail::PlaceChildren does.
  void place(const detail::NodesMaking& making, const detail::TreeRoot* root, LightNode* placed);

 private:
  [[nodiscard]] bool fills_the_device(const detail::TilePass& pass) const;
  void merge_many_leaves(const detail::MakeLeaves<Vpl>& make, const detail::TilePass& pass);
  void merge_leaf_tiles(const detail::TilePass& pass);
};

}  // namespace lightcuts::cuda
