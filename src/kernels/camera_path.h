#pragma once

#include "kernels/emitters.h"
#include "kernels/light_path.h"

namespace lightcuts {

/// Weight of a sample drawn with density `a` that could have been drawn with density `b` as well.
/// Source: Veach 1997, the power heuristic with exponent 2; written so that large densities do not overflow.
LC_KERNEL float power_heuristic(float a, float b) {
  if (!(a > 0)) return 0;
  const float r = b / a;
  return 1 / (1 + r * r);
}

/// Density per steradian with which sample_direct would have met what a ray of unit direction hit.
LC_KERNEL float pdf_direct_of_hit(const SceneView& scene, const EmitterView& e, const Hit& hit, Vec3 direction) {
  const std::uint32_t first = e.first_entry[hit.instance];
  if (first == kNone) return 0;
  const TriangleGeometry g = triangle_geometry(scene, hit.instance, hit.triangle);
  return pdf_area_direct(e, first + hit.triangle, g, direction, hit.t);
}

/// Light that comes to `s` straight from an emitter, reflected towards the viewer: one sample, weighed against the
/// chance that the path's next ray meets the emitter.
template <class Tracer>
LC_KERNEL Vec3 estimate_direct(const SceneView& scene, const EmitterView& e, const Tracer& tracer, const Surface& s,
                               const Sample4& sample) {
  const DirectSample light = sample_direct(scene, e, s.position, sample);
  const float cosine = dot(s.ns, light.direction);
  if (!(cosine > 0) || !(dot(s.ng, light.direction) > 0) || !(max_component(light.irradiance) > 0)) return {};
  const bool outside = !(light.distance < kInfinity);
  const Ray ray{s.position, 0, light.direction, outside ? kInfinity : light.distance * kShadowRayEnd};
  if (tracer.occluded(ray)) return {};
  float weight = 1;
  if (light.pdf > 0) weight = power_heuristic(light.pdf, pdf_cosine_hemisphere(cosine));
  return s.albedo * light.irradiance * (kInvPi * cosine * weight);
}

/// Unbiased estimate of the radiance that comes along a camera ray of unit direction, after at most `reflections`.
///
/// Next-event estimation over all emitters, combined with cosine sampling about the shading normal by multiple
/// importance sampling. Group 0 of `stream` is the camera's; each vertex draws the two after it.
template <class Tracer>
LC_KERNEL Vec3 estimate_radiance(const SceneView& scene, const EmitterView& e, const Tracer& tracer, Ray ray,
                                 const SampleStream& stream, int reflections) {
  Vec3 radiance, throughput{1, 1, 1};
  float pdf = 0;  // of the ray's direction; 0: the camera's, which no light sample competes with
  for (int depth = 0;; ++depth) {
    const Hit hit = tracer.intersect(ray);
    if (!hit.valid()) {
      if (e.environment_count == 0) break;
      const float p_sky = static_cast<float>(pdf_emitter(e, e.punctual_end()));
      const float weight =
          depth == 0 ? 1.0f : power_heuristic(pdf, p_sky * pdf_environment(e.environment, ray.direction));
      radiance += throughput * eval_environment(e.environment, ray.direction) * weight;
      break;
    }
    const Surface s = surface_at(scene, hit, ray.direction);
    if (max_component(s.emission) > 0) {
      const float weight = depth == 0 ? 1.0f : power_heuristic(pdf, pdf_direct_of_hit(scene, e, hit, ray.direction));
      radiance += throughput * s.emission * weight;
    }
    if (depth == reflections) break;

    const auto group = static_cast<std::uint32_t>(1 + 2 * depth);
    radiance += throughput * estimate_direct(scene, e, tracer, s, stream.draw(group));

    // Go on, cosine-distributed about the shading normal: f cos / pdf is the albedo.
    const Sample4 next = stream.draw(group + 1);
    const Vec3 local = sample_cosine_hemisphere(next.unit2(0));
    const Vec3 direction = normalize(to_world(make_frame(s.ns), local));
    if (!(dot(s.ng, direction) > 0)) break;
    throughput = throughput * s.albedo;
    const float left = max_component(throughput);
    if (!(left > 0)) break;
    if (depth >= 2) {
      const float survival = min_of(kMaxSurvival, left);
      if (next.unit(2) >= survival) break;
      throughput = throughput / survival;
    }
    pdf = pdf_cosine_hemisphere(dot(s.ns, direction));
    ray = {s.position, 0, direction, kInfinity};
  }
  return radiance;
}

}  // namespace lightcuts
