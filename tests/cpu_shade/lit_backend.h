#pragma once

#include <cstdint>
#include <utility>

#include "cpu/cpu_backend.h"

namespace lightcuts {

/// A scene on the CPU's backend with its lights and their trees: all that pictures need.
struct LitBackend {
  Scene scene;
  CpuBackend backend;
  Statistics statistics;  ///< of the last picture

  LitBackend(Scene s, std::uint64_t vpls, int threads = 2) : scene(std::move(s)), backend(threads) {
    validate(scene);
    backend.set_scene(scene, {});
    VplOptions options;
    options.count = vpls;
    backend.trace_vpls(options, {});
    backend.build_light_tree({}, {});
  }
  Image shade(const Camera& camera, int width, int height, const ShadeOptions& options, std::uint64_t memory = 0) {
    statistics = {};
    return backend.shade(camera, width, height, options, memory, statistics, {}).image;
  }
};

}  // namespace lightcuts
