#pragma once

#include <cstdint>

#include "cuda/warp.cuh"
#include "lightcuts/math.h"

namespace lightcuts::cuda {

/// Who lights a group of pixels: a warp, or where there are very many nodes the warps of several blocks. The warps of a
/// block walk together, the blocks of a crew share out the nodes that wait, and after each walk all get the same sums, and so
/// come to the same decisions.
enum class Crew { warp, blocks };

/// What a crew has to agree on: whether lights could not be looked at, and whether it is too much for it.
struct CrewFlags {
  bool missed = false, heavy = false;
};

/// What some warps of a crew found for a pixel.
struct CrewPart {
  Vec3T<double> light{};
  double lost = 0;
  std::uint32_t found = 0, rays = 0;
  float largest = 0, own_largest = 0;

  __device__ void add(const CrewPart& other) {
    light += other.light;
    lost += other.lost;
    found += other.found;
    rays += other.rays;
    largest = fmaxf(largest, other.largest);
    own_largest = fmaxf(own_largest, other.own_largest);
  }
};

/// Where the blocks of a crew meet, in global memory. They must all be resident at once.
///
/// `board` has room for two meetings, one being read while the next is written: kBoardWords words for each lane of each block
/// in each. `arrivals` counts, from 0 and for ever, blocks that came to a meeting.
class Meeting {
 public:
  static constexpr int kBoardWords = (sizeof(CrewPart) + 15) / 8;  ///< of 64 bits: the part, and the flags

  Meeting() = default;
  __device__ Meeting(unsigned long long* board, unsigned* arrivals, int blocks, int rank)
      : board_(board), arrivals_(arrivals), blocks_(blocks), rank_(rank) {}

  [[nodiscard]] __device__ int blocks() const { return blocks_; }
  [[nodiscard]] __device__ int rank() const { return rank_; }

  /// By all threads of all blocks: adds up the parts of the blocks, in their order, and whether any brings a flag. Each warp
  /// of a block brings the same.
  __device__ CrewPart add_up(const CrewPart& part, CrewFlags& flags) {
    const auto lane = threadIdx.x % 32;
    unsigned long long* const half = board_ + held_ % 2 * static_cast<unsigned>(blocks_) * kPlaces;
    if (threadIdx.x < 32) {
      unsigned long long words[kBoardWords] = {};
      memcpy(words, &part, sizeof part);
      words[kBoardWords - 1] = (flags.missed ? 1u : 0u) | (flags.heavy ? 2u : 0u);
      for (int i = 0; i < kBoardWords; ++i) half[(rank_ * kBoardWords + i) * 32 + lane] = words[i];
    }
    ++held_;
    __syncthreads();
    if (threadIdx.x == 0) {
      __threadfence();
      atomicAdd(arrivals_, 1u);
      const unsigned all = held_ * static_cast<unsigned>(blocks_);
      while (*static_cast<volatile unsigned*>(arrivals_) < all) {
      }
      __threadfence();
    }
    __syncthreads();
    CrewPart sum;
    unsigned long long any = 0;
    for (int block = 0; block < blocks_; ++block) {
      unsigned long long words[kBoardWords];
      for (int i = 0; i < kBoardWords; ++i) words[i] = __ldcg(&half[(block * kBoardWords + i) * 32 + lane]);
      CrewPart other;
      memcpy(&other, words, sizeof other);
      sum.add(other);
      any |= words[kBoardWords - 1];
    }
    flags = {(any & 1) != 0, (any & 2) != 0};
    return sum;
  }

  /// Words of the board for so many blocks.
  __host__ __device__ static std::size_t board_words(std::size_t blocks) { return 2 * blocks * kPlaces; }

 private:
  static constexpr unsigned kPlaces = 32 * kBoardWords;

  unsigned long long* board_ = nullptr;
  unsigned* arrivals_ = nullptr;
  int blocks_ = 1, rank_ = 0;
  unsigned held_ = 0;
};

}  // namespace lightcuts::cuda
