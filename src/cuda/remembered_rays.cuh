#pragma once

#include "cuda/device.h"
#include "cuda/warp.cuh"

namespace lightcuts::cuda {

/// Memory for what became of shadow rays, a part for each warp or block that lights groups at the same time.
struct RayMemory {
  static constexpr std::uint32_t kOfWarp = 1024, kOfBlock = 8192;  ///< lights: powers of two

  std::uint32_t* lights = nullptr;     ///< null: nothing is remembered
  unsigned long long* rays = nullptr;  ///< traced ones in the upper half, those that arrived in the lower
};

/// What became of the shadow rays of a group's earlier walks. A node's light is also that of one of its children, so
/// each walk asks again for what the ones before it asked for, but for those nodes that they did not open.
///
/// Shared by the threads that have its memory. Entries are added and never replaced, in whatever order: what is
/// forgotten is traced again, so only speed and the number of rays that were traced depend on it.
class RememberedRays {
 public:
  /// A light's rays, by pixels.
  struct Rays {
    unsigned traced = 0, arrived = 0;
  };

  RememberedRays() = default;
  /// @param first, size  the lights' places of the memory that are these threads' own; size a power of two
  __device__ RememberedRays(const RayMemory& memory, std::size_t first, std::uint32_t size)
      : lights_(memory.lights == nullptr ? nullptr : memory.lights + first),
        rays_(memory.rays == nullptr ? nullptr : memory.rays + first),
        size_(size) {}

  /// By `threads` threads together, who meet afterwards.
  __device__ void forget(std::uint32_t thread, std::uint32_t threads) const {
    if (lights_ == nullptr) return;
    for (std::uint32_t i = thread; i < size_; i += threads) {
      lights_[i] = 0;
      rays_[i] = 0;
    }
  }

  [[nodiscard]] __device__ Rays of(int kind, std::uint32_t light) const {
    if (lights_ == nullptr) return {};
    const std::uint32_t key = key_of(kind, light);
    for (std::uint32_t i = 0; i < kProbes; ++i) {
      const std::uint32_t place = place_of(key, i), there = *const_cast<volatile std::uint32_t*>(&lights_[place]);
      if (there == 0) break;
      if (there != key) continue;
      const unsigned long long both = *const_cast<volatile unsigned long long*>(&rays_[place]);
      return {static_cast<unsigned>(both >> 32), static_cast<unsigned>(both)};
    }
    return {};
  }

  __device__ void add(int kind, std::uint32_t light, Rays rays) const {
    if (lights_ == nullptr || rays.traced == 0) return;
    const std::uint32_t key = key_of(kind, light);
    for (std::uint32_t i = 0; i < kProbes; ++i) {
      const std::uint32_t place = place_of(key, i), there = atomicCAS(&lights_[place], 0u, key);
      if (there != 0 && there != key) continue;
      atomicOr(&rays_[place], static_cast<unsigned long long>(rays.traced) << 32 | rays.arrived);
      return;
    }
  }

 private:
  static constexpr std::uint32_t kProbes = 4;

  __device__ static std::uint32_t key_of(int kind, std::uint32_t light) {
    return (light << 2 | static_cast<std::uint32_t>(kind)) + 1;
  }
  __device__ std::uint32_t place_of(std::uint32_t key, std::uint32_t probe) const {
    return ((key * 0x9e3779b9u >> 12) + probe) & (size_ - 1);
  }

  std::uint32_t* lights_ = nullptr;
  unsigned long long* rays_ = nullptr;
  std::uint32_t size_ = 0;
};

}  // namespace lightcuts::cuda
