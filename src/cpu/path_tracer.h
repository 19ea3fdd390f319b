#pragma once

#include <cstdint>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "cpu/ray_tracer.h"
#include "kernels/camera.h"
#include "kernels/light_path.h"

namespace lightcuts {

/// The unbiased oracle of all lit pictures. Keeps references: scene, emitters and tracer must outlive it.
/// May be used from any number of threads.
class PathTracer {
 public:
  /// `bounces` + 1 reflections are followed, kMaxBounces + 1 at most, as the VPLs' light paths do.
  PathTracer(const SceneArrays& scene, const EmitterTable& emitters, const RayTracer& tracer, int bounces,
             std::uint64_t seed);

  /// Where sample `sample` of pixel (x, y) falls within the pixel, in [0, 1)^2.
  [[nodiscard]] Vec2 position_in_pixel(const CameraView& camera, int x, int y, std::uint32_t sample) const;
  /// Radiance of camera sample `sample` of pixel (x, y). The pixel's value is the mean over samples.
  [[nodiscard]] Vec3 radiance(const CameraView& camera, int x, int y, std::uint32_t sample) const;
  /// Radiance that comes along a ray; `index` names the random stream.
  [[nodiscard]] Vec3 radiance_along(const Ray& ray, std::uint32_t index) const;

 private:
  const SceneArrays& scene_;
  const EmitterTable& emitters_;
  const RayTracer& tracer_;
  int reflections_;
  std::uint64_t seed_;
};

}  // namespace lightcuts
