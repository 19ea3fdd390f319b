#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "backend/scene_arrays.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/light_set.h"
#include "cpu/ray_tracer.h"
#include "lightcuts/lights.h"

namespace lightcuts::app::study {

/// Texels a side of the study's maps.
inline constexpr int kStudyMapSide = 128;

/// Points that are drawn about a texel large, as the study's were: they leave holes for pull-push to fill.
inline constexpr PointOptions kStudyPoints{.per_map = 16000, .overlap = 0.4f, .seed = 1};

/// The study's room with lights, for looking at single shadow maps. Made on the CPU whatever backend is measured: both
/// make the same maps.
class CpuMaps {
 public:
  explicit CpuMaps(std::uint64_t n);

  /// Depth codes of the maps of `count` VPLs, from light `first` on; `levels` of pull and push.
  [[nodiscard]] std::vector<std::vector<std::uint16_t>> make(std::size_t first, std::size_t count,
                                                             const PointOptions& points, int levels,
                                                             HoleFill fill) const;
  [[nodiscard]] const Lights& lights() const { return lights_; }

 private:
  SceneArrays scene_;
  RayTracer tracer_;
  Lights lights_;
  LightSet light_set_;
};

}  // namespace lightcuts::app::study
