#pragma once

#include "kernels/emitters.h"
#include "lightcuts/lights.h"

namespace lightcuts {

/// No path is longer, however bright the surfaces.
inline constexpr int kMaxBounces = 64;
/// Russian roulette ends every path with at least one chance in twenty.
inline constexpr float kMaxSurvival = 0.95f;

struct LightPathOptions {
  int bounces = kMaxBounces;    ///< deposits along a path at most
  float study_distance_sq = 0;  ///< above 0: the study's inverse-square deposit with this reference distance [m^2]
};

/// Follows a photon and calls `deposit(Vpl)` at every reflection.
///
/// At a hit the flux is multiplied by the albedo and by (w.n_s) / (w.n_g), zero where the shading normal faces away:
/// the adjoint of a receiver that uses the cosine of its shading normal (Veach 1997, section 5.3). The factor is not
/// bounded, so nothing is biased. The photon goes on cosine-distributed about n_g. Roulette keeps it with the share of
/// its flux that is left of what it started with, so that all deposits carry about as much. Draws groups 2, 3, ... of
/// `stream`. Source: Keller 1997; reference eqs. (3.2), (3.3), (3.6).
template <class Tracer, class Deposit>
LC_KERNEL void trace_light_path(const SceneView& scene, const Tracer& tracer, const EmittedRay& start,
                                const SampleStream& stream, const LightPathOptions& options, Deposit&& deposit) {
  const float start_flux = max_component(start.flux);
  Vec3 flux = start.flux;
  Ray ray{start.origin, 0, start.direction, kInfinity};
  for (int bounce = 1; bounce <= options.bounces; ++bounce) {
    const Hit hit = tracer.intersect(ray);
    if (!hit.valid()) return;
    const Surface s = surface_at(scene, hit, ray.direction);
    const float cos_geometric = -dot(s.ng, ray.direction), cos_shading = -dot(s.ns, ray.direction);
    if (!(cos_geometric > 0) || !(cos_shading > 0)) return;
    flux = flux * s.albedo * (cos_shading / cos_geometric);
    if (options.study_distance_sq > 0 && !(bounce == 1 && start.parallel)) {
      flux *= min_of(1.0f, options.study_distance_sq / max_of(hit.t * hit.t, 1e-30f));  // (3.6)
    }
    const float left = max_component(flux);
    if (!(left > 0 && left < kInfinity)) return;
    deposit(Vpl{s.position, s.ng, flux * kInvPi});  // (3.3)
    if (bounce == options.bounces) return;

    const Sample4 sample = stream.draw(static_cast<std::uint32_t>(bounce) + 1);
    const float survival = min_of(kMaxSurvival, left / start_flux);
    if (sample.unit(2) >= survival) return;
    flux = flux / survival;
    ray = {s.position, 0, to_world(make_frame(s.ng), sample_cosine_hemisphere(sample.unit2(0))), kInfinity};
  }
}

/// The light path of one stream, its emitter chosen by power out of all.
template <class Tracer, class Deposit>
LC_KERNEL void trace_light_path_of_stream(const SceneView& scene, const EmitterView& emitters, const Tracer& tracer,
                                          const SampleStream& stream, float flux_scale, const LightPathOptions& options,
                                          Deposit&& deposit) {
  const Sample4 where = stream.draw(0), which = stream.draw(1);
  const Choice choice = sample_emitter(emitters, 0, emitters.entry_count(), which.unit_double(0));
  EmittedRay start =
      sample_emission(scene, emitters, choice.index, choice.probability, where.unit2(0), which.unit(1), where.unit2(2));
  start.flux *= flux_scale;
  trace_light_path(scene, tracer, start, stream, options, deposit);
}

/// True for a light that is worth keeping.
LC_KERNEL bool carries_light(Vec3 v) {
  const float largest = max_component(v);
  return largest > 0 && largest < kInfinity && min_component(v) > -kInfinity;
}

/// A sample of an emitter that light paths can start from.
struct PrimarySample {
  std::uint32_t entry = 0;
  double probability = 0;
  Vec2 start;
  float side = 0;
};

/// Draws one of the emitters [first, last) by power, and a point or direction of it.
LC_KERNEL PrimarySample draw_primary(const EmitterView& emitters, const SampleStream& stream, std::uint32_t first,
                                     std::uint32_t last) {
  const Sample4 where = stream.draw(0), which = stream.draw(1);
  const Choice choice = sample_emitter(emitters, first, last, which.unit_double(0));
  return {choice.index, choice.probability, where.unit2(0), which.unit(1)};
}

/// The light path of one stream from a primary sample that many paths share.
template <class Tracer, class Deposit>
LC_KERNEL void trace_light_path_of_primary(const SceneView& scene, const EmitterView& emitters, const Tracer& tracer,
                                           const PrimarySample& primary, const SampleStream& stream, float flux_scale,
                                           const LightPathOptions& options, Deposit&& deposit) {
  EmittedRay start = sample_emission(scene, emitters, primary.entry, primary.probability, primary.start, primary.side,
                                     stream.draw(0).unit2(2));
  start.flux *= flux_scale;
  trace_light_path(scene, tracer, start, stream, options, deposit);
}

}  // namespace lightcuts
