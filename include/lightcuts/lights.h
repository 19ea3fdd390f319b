#pragma once

#include <cstdint>
#include <vector>

#include "lightcuts/math.h"
#include "lightcuts/scene.h"
#include "lightcuts/vpl.h"

namespace lightcuts {

/// All the lights that a pixel sums over. The three kinds stay apart because their bounds differ.
struct Lights {
  std::vector<Vpl> vpls;                       ///< area-light samples first, then the VPLs of light paths
  std::vector<PointLight> points;              ///< point and spot lights of the scene
  std::vector<DirectionalLight> directionals;  ///< directional lights and samples of the environment
  std::uint64_t primary_count = 0;             ///< how many of `vpls` lie on area lights
  std::uint64_t sky_count = 0;                 ///< how many of `directionals`, the first, are environment samples
  std::uint64_t path_count = 0;                ///< light paths that were traced

  [[nodiscard]] std::uint64_t count() const { return vpls.size() + points.size() + directionals.size(); }
};

}  // namespace lightcuts
