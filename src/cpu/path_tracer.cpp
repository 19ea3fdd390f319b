#include "cpu/path_tracer.h"

#include <algorithm>

#include "kernels/camera_path.h"
#include "kernels/pixel_sample.h"

namespace lightcuts {
PathTracer::PathTracer(const SceneArrays& scene, const EmitterTable& emitters, const RayTracer& tracer, int bounces,
                       std::uint64_t seed)
    : scene_(scene),
      emitters_(emitters),
      tracer_(tracer),
      reflections_(std::clamp(bounces, 0, kMaxBounces) + 1),
      seed_(seed) {}

Vec2 PathTracer::position_in_pixel(const CameraView& camera, int x, int y, std::uint32_t sample) const {
  return pixel_stream(seed_, static_cast<int>(camera.width_px), x, y, sample).draw(0).unit2(0);
}

Vec3 PathTracer::radiance(const CameraView& camera, int x, int y, std::uint32_t sample) const {
  const SampleStream stream = pixel_stream(seed_, static_cast<int>(camera.width_px), x, y, sample);
  const Vec2 inside = stream.draw(0).unit2(0);
  const Ray ray = camera_ray(camera, static_cast<float>(x) + inside.x, static_cast<float>(y) + inside.y);
  return estimate_radiance(scene_.view(), emitters_.view(), tracer_, ray, stream, reflections_);
}

Vec3 PathTracer::radiance_along(const Ray& ray, std::uint32_t index) const {
  return estimate_radiance(scene_.view(), emitters_.view(), tracer_, ray, {seed_, index, true}, reflections_);
}

}  // namespace lightcuts
