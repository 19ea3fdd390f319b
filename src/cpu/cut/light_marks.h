#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "backend/light_tree.h"
#include "cpu/visibility.h"

namespace lightcuts {

/// Which lights represent some node of some pixel's cut: what an image really uses. Written by many threads at once.
class LightMarks {
 public:
  explicit LightMarks(const LightTrees& trees)
      : marks_{std::vector<std::uint8_t>(trees.vpls.nodes.size() / 2 + 1),
               std::vector<std::uint8_t>(trees.points.nodes.size() / 2 + 1),
               std::vector<std::uint8_t>(trees.directionals.nodes.size() / 2 + 1)} {}

  void set(LightKind kind, std::uint32_t light) {
    std::atomic_ref<std::uint8_t> mark(marks_[static_cast<std::size_t>(kind)][light]);
    if (mark.load(std::memory_order_relaxed) == 0) mark.store(1, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t count() const {
    std::uint64_t sum = 0;
    for (const auto& kind : marks_) {
      for (const std::uint8_t mark : kind) sum += mark;
    }
    return sum;
  }

 private:
  std::array<std::vector<std::uint8_t>, 3> marks_;
};

}  // namespace lightcuts
