#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <string>

#include "render/memory.h"

namespace lightcuts::test {

/// Numbers for damaging files, the same on every machine.
class Damage {
 public:
  std::size_t below(std::size_t limit) {
    state_ = state_ * 1664525u + 1013904223u;
    return static_cast<std::size_t>(state_ >> 8) % limit;
  }
  /// Flips one to four bits among the first `range` bytes.
  void flip_bits(std::string& bytes, std::size_t range) {
    for (std::size_t flips = 1 + below(4); flips > 0; --flips) bytes[below(range)] ^= static_cast<char>(1 << below(8));
  }

 private:
  std::uint32_t state_ = 1;
};

/// While it lives a damaged file is read: that may take 10 s of processor time (other programs do not count), and this
/// whole process at most 1 GiB.
class ModestReading {
 public:
  ModestReading() = default;
  ~ModestReading() {
    EXPECT_LT(std::clock() - start_, 10 * CLOCKS_PER_SEC);
#ifndef __SANITIZE_ADDRESS__
    EXPECT_LT(peak_memory_bytes(), std::uint64_t{1} << 30);
#endif
  }
  ModestReading(const ModestReading&) = delete;
  ModestReading& operator=(const ModestReading&) = delete;

 private:
  std::clock_t start_ = std::clock();
};

}  // namespace lightcuts::test
