#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "lightcuts/lights.h"

namespace lightcuts::test {

/// Random numbers and small sets of lights for the tree's tests; the same on every machine.
class LightSamples {
 public:
  explicit LightSamples(std::uint64_t seed) : random_(seed) {}

  float uniform() { return static_cast<float>(static_cast<double>(random_() >> 11) * 0x1.0p-53); }
  float uniform(float lo, float hi) { return lo + (hi - lo) * uniform(); }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
  Vec3 point() { return {uniform(), uniform(), uniform()}; }
  Vec3 direction() {
    const float z = uniform(-1, 1), phi = 2 * kPi * uniform(), r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
  }

  /// Lights anywhere in the unit cube.
  std::vector<Vpl> scattered(std::size_t count) {
    std::vector<Vpl> lights;
    for (std::size_t i = 0; i < count; ++i) lights.push_back({point(), direction(), point()});
    return lights;
  }

  /// Lights on the walls of the unit cube, facing in; intensities from 0.2 to 1.2.
  std::vector<Vpl> on_walls(std::size_t count) {
    std::vector<Vpl> lights;
    for (std::size_t i = 0; i < count; ++i) {
      Vpl light{point(), {}, Vec3{1, 1, 1} * uniform(0.2f, 1.2f)};
      const std::uint32_t wall = below(6);
      float* position[3] = {&light.position.x, &light.position.y, &light.position.z};
      float* axis[3] = {&light.axis.x, &light.axis.y, &light.axis.z};
      *position[wall / 2] = static_cast<float>(wall % 2);
      *axis[wall / 2] = wall % 2 == 0 ? 1.0f : -1.0f;
      lights.push_back(light);
    }
    return lights;
  }

  /// Lights on a coarse grid with few axes and colours: many ties, many that agree in part or wholly.
  std::vector<Vpl> with_ties(std::size_t count) {
    const Vec3 axes[3] = {{0, 0, 1}, {0, 1, 0}, {0, 0.6f, 0.8f}};
    const Vec3 colors[3] = {{1, 1, 1}, {0.5f, 0.25f, 0}, {0, 0, 0}};
    std::vector<Vpl> lights;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 cell{static_cast<float>(below(3)), static_cast<float>(below(3)), static_cast<float>(below(2))};
      lights.push_back({cell, axes[below(3)], colors[below(3)] * (below(2) == 0 ? 1.0f : 3.0f)});
    }
    return lights;
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace lightcuts::test
