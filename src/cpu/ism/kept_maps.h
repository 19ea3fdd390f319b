#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "backend/backend.h"
#include "cpu/ism/light_maps.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/ism/surface_points.h"

namespace lightcuts {

/// What pictures by shadow maps leave for the next one: points of the scene, and maps of the lights of either cuts or the sum
/// over all. A map depends on its light, the points and the options only, so that a picture is the same with and without.
class KeptMaps {
 public:
  /// The points of a scene, made where those that are there are others.
  const SurfacePoints& points(const SceneView& scene, const PointOptions& options, StageCounts& counts);

  /// Maps for cuts of up to `room` lights' maps at a time, and how many threads look them up; those of the last picture,
  /// as far as they serve. The set of lights must stay where it is.
  LightMaps& for_cuts(const IsmKernels& kernels, const LightSet& lights, const ShadowMapOptions& options,
                      std::size_t room, int threads);

  /// Sets of the maps of all lights, one a batch, or one for all of them where nothing is kept.
  std::vector<std::unique_ptr<ShadowMapSet>>& for_all(const IsmKernels& kernels, const LightSet& lights,
                                                      const ShadowMapOptions& options, std::size_t sets);

  /// Forgets the maps of lights that stand elsewhere; all where there are more or fewer of them.
  void lights_change(const LightSet& from, const LightSet& to);

  void forget_maps();
  void forget();
  [[nodiscard]] bool has_maps() const { return for_cuts_ != nullptr || !for_all_.empty(); }
  [[nodiscard]] std::uint64_t bytes() const;  ///< of points and maps

 private:
  std::unique_ptr<SurfacePoints> points_;
  std::unique_ptr<LightMaps> for_cuts_;
  std::vector<std::unique_ptr<ShadowMapSet>> for_all_;
};

}  // namespace lightcuts
