#pragma once

#include <array>
#include <vector>

#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"

namespace lightcuts {

/// Some lights of a scene, side by side: bright ones rather than dark ones.
class LightSamples {
 public:
  explicit LightSamples(bool directions = false) : directions_(directions) {}
  void push_back(Vec3 place);
  [[nodiscard]] LightPlaces view() const { return {x_.data(), y_.data(), z_.data(), count_, directions_}; }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::vector<float> x_, y_, z_;
  std::size_t count_ = 0;
  bool directions_;
};

/// Nodes of the trees that together hold every light, the brightest split first: a first guess of what a pixel gets.
struct Frontier {
  std::array<std::vector<CutLight>, 3> lights;   ///< by LightKind
  LightSamples places{false}, directions{true};  ///< where the lights of a larger frontier are
};

/// At most `size` nodes of each tree. The samples are representatives of frontiers of kLightSamples nodes.
Frontier make_frontier(const CutContext& context, std::uint32_t size);
inline constexpr std::uint32_t kLightSamples = 512;

}  // namespace lightcuts
