#pragma once

#include "kernels/environment.h"
#include "kernels/surface.h"
#include "math/frame.h"
#include "math/sample_stream.h"
#include "math/warp.h"

namespace lightcuts {

/// An instance whose triangles emit, and where they stand in the table of emitters.
struct EmissiveInstance {
  std::uint32_t instance = 0;
  std::uint32_t first_entry = 0;
};

/// Everything that emits, in one table: emissive triangles, then punctual lights (point and spot, directional), then
/// the environment, if there is one. An entry's weight is the luminance of its flux [W].
struct EmitterView {
  const double* prefix = nullptr;  ///< entry_count() + 1 prefix sums of the weights
  std::uint32_t triangle_count = 0, point_count = 0, directional_count = 0, environment_count = 0;
  const EmissiveInstance* instances = nullptr;  ///< by first_entry
  std::uint32_t instance_count = 0;
  const std::uint32_t* first_entry = nullptr;  ///< for each instance of the scene; kNone: does not emit
  const PointLight* points = nullptr;
  const DirectionalLight* directionals = nullptr;
  EnvironmentView environment;
  Vec3 center;       ///< of a sphere around the scene [m]
  float radius = 1;  ///< [m]

  [[nodiscard]] LC_FN std::uint32_t punctual_end() const { return triangle_count + point_count + directional_count; }
  [[nodiscard]] LC_FN std::uint32_t entry_count() const { return punctual_end() + environment_count; }
};

/// Chooses one of the entries [first, last) by power. At least one of them must have weight.
LC_KERNEL Choice sample_emitter(const EmitterView& e, std::uint32_t first, std::uint32_t last, double u) {
  return sample_prefix(e.prefix, first, last, u);
}
/// Probability with which sample_emitter chooses `entry` out of all.
LC_KERNEL double pdf_emitter(const EmitterView& e, std::uint32_t entry) {
  return (e.prefix[entry + 1] - e.prefix[entry]) / e.prefix[e.entry_count()];
}

/// Radiant intensity of a point or spot light in the unit direction `away` [W/sr]. KHR_lights_punctual's falloff.
LC_KERNEL Vec3 eval_point_light(const PointLight& light, Vec3 away) {
  if (light.cos_outer < -1) return light.intensity;
  const float soft = max_of(light.cos_inner - light.cos_outer, 1e-6f);
  const float s = clamp_to((dot(light.axis, away) - light.cos_outer) / soft, 0.0f, 1.0f);
  return light.intensity * (s * s);
}

/// Integral of the intensity's shape over all directions: flux = intensity times this [sr].
LC_KERNEL float point_light_solid_angle(const PointLight& light) {
  if (light.cos_outer < -1) return 4 * kPi;
  return 2 * kPi * ((1 - light.cos_inner) + max_of(light.cos_inner - light.cos_outer, 1e-6f) / 3);
}

/// Direction with a density proportional to the intensity: the cosine's distribution function is a straight line in
/// the inner cone and a cubic between the cones.
LC_KERNEL Vec3 sample_point_light(const PointLight& light, Vec2 u) {
  if (light.cos_outer < -1) return sample_sphere(u);
  const float inner = 1 - light.cos_inner, soft = max_of(light.cos_inner - light.cos_outer, 1e-6f);
  const float x = u.x * (inner + soft / 3);
  const float cosine =
      x < inner ? 1 - x : light.cos_outer + soft * std::cbrt(clamp_to(1 - 3 * (x - inner) / soft, 0.0f, 1.0f));
  return to_world(make_frame(light.axis), direction_from_cosine(cosine, u.y));
}
LC_KERNEL float pdf_point_light(const PointLight& light, Vec3 away) {
  const float peak = max_component(light.intensity);
  return max_component(eval_point_light(light, away)) / (peak * point_light_solid_angle(light));
}

/// Entry of the table -> triangle of an instance.
struct TriangleId {
  std::uint32_t instance = 0, triangle = 0;
};
LC_KERNEL TriangleId emissive_triangle(const EmitterView& e, std::uint32_t entry) {
  std::uint32_t lo = 0, hi = e.instance_count - 1;
  while (lo < hi) {
    const std::uint32_t middle = lo + (hi - lo + 1) / 2;
    if (e.instances[middle].first_entry <= entry) {
      lo = middle;
    } else {
      hi = middle - 1;
    }
  }
  return {e.instances[lo].instance, entry - e.instances[lo].first_entry};
}

/// Radiance of the emitting side(s), nothing where an alpha mask cuts the triangle away.
LC_KERNEL Vec3 emitted_radiance(const SceneView& scene, const MeshView& mesh, std::uint32_t triangle, float u,
                                float v) {
  return cut_away(scene, mesh, triangle, u, v) ? Vec3{} : emission_at(scene, mesh, triangle, u, v);
}

/// A point on an emitter, as a light of the sum with one sample: its intensity along the axis is radiance * area for
/// the whole triangle. A double-sided triangle shows each side half of the time with twice that.
struct AreaSample {
  Vec3 position, axis;
  Vec3 intensity;  ///< not yet divided by the probability of the entry and the number of samples [W/sr]
};
LC_KERNEL AreaSample sample_area(const SceneView& scene, const EmitterView& e, std::uint32_t entry, Vec2 u,
                                 float side) {
  const TriangleId id = emissive_triangle(e, entry);
  const MeshView& mesh = scene.meshes[scene.instances[id.instance].mesh];
  const TriangleGeometry g = triangle_geometry(scene, id.instance, id.triangle);
  const bool both = scene.materials[mesh.material].double_sided;
  const Vec2 b = sample_triangle(u);
  AreaSample s;
  s.axis = both && side < 0.5f ? -g.front : g.front;
  s.position = point_on_triangle(g, b.x, b.y, s.axis);
  s.intensity = emitted_radiance(scene, mesh, id.triangle, b.x, b.y) * (both ? 2 * g.area : g.area);
  return s;
}

/// A photon as it leaves an emitter.
struct EmittedRay {
  Vec3 origin, direction;  ///< [m], unit
  Vec3 flux;               ///< [W], for a single path
  bool parallel = false;   ///< it comes from infinitely far: the study's falloff does not apply to its first segment
};

/// Sends a photon from a disc that covers the scene's sphere. `irradiance` [W/m^2] on a surface that faces it.
LC_KERNEL EmittedRay emit_parallel(const EmitterView& e, Vec3 direction, Vec3 irradiance, Vec2 u) {
  const Vec2 d = sample_disc(u);
  const Vec3 across = to_world(make_frame(direction), {d.x, d.y, -1});
  return {e.center + across * e.radius, direction, irradiance * (kPi * e.radius * e.radius), true};
}

/// Draws how a photon leaves emitter `entry`, which was chosen with `probability`.
/// `start` draws what a primary sample fixes (the point on a triangle, the direction of the sky), `side` a double-sided
/// triangle's side, `rest` what is left.
LC_KERNEL EmittedRay sample_emission(const SceneView& scene, const EmitterView& e, std::uint32_t entry,
                                     double probability, Vec2 start, float side, Vec2 rest) {
  EmittedRay ray;
  if (entry < e.triangle_count) {
    const AreaSample s = sample_area(scene, e, entry, start, side);
    ray = {s.position, to_world(make_frame(s.axis), sample_cosine_hemisphere(rest)), s.intensity * kPi, false};
  } else if (entry < e.triangle_count + e.point_count) {
    const PointLight& light = e.points[entry - e.triangle_count];
    ray = {light.position, sample_point_light(light, rest), light.intensity * point_light_solid_angle(light), false};
  } else if (entry < e.punctual_end()) {
    const DirectionalLight& light = e.directionals[entry - e.triangle_count - e.point_count];
    ray = emit_parallel(e, light.direction, light.irradiance, rest);
  } else {
    const EnvironmentSample sky = sample_environment(e.environment, start.x, start.y);
    ray = emit_parallel(e, -sky.direction, sky.pdf > 0 ? sky.radiance / sky.pdf : Vec3{}, rest);
  }
  ray.flux = ray.flux * static_cast<float>(1 / probability);
  return ray;
}

/// Light that may reach a point from a sample of an emitter, if nothing is between.
struct DirectSample {
  Vec3 direction;      ///< unit, towards the light
  float distance = 0;  ///< to the light [m], infinite for light from outside
  Vec3 irradiance;     ///< on a surface that faces the light, divided by the density [W/m^2]
  float pdf = 0;       ///< density per steradian; 0: the light is a point or a direction, no ray meets it by chance
};

/// Density per steradian, at a point `distance` away, with which sample_direct draws the point of an emissive triangle.
LC_KERNEL float pdf_area_direct(const EmitterView& e, std::uint32_t entry, const TriangleGeometry& g, Vec3 direction,
                                float distance) {
  const float cosine = std::fabs(dot(g.front, direction));
  return cosine > 0 ? static_cast<float>(pdf_emitter(e, entry)) * (distance / g.area) * (distance / cosine) : 0.0f;
}

LC_KERNEL DirectSample sample_area_direct(const SceneView& scene, const EmitterView& e, std::uint32_t entry,
                                          Vec3 receiver, Vec2 u) {
  const TriangleId id = emissive_triangle(e, entry);
  const MeshView& mesh = scene.meshes[scene.instances[id.instance].mesh];
  const TriangleGeometry g = triangle_geometry(scene, id.instance, id.triangle);
  const bool from_front = dot(receiver - g.p0, g.front) > 0;
  DirectSample s;
  if (!from_front && !scene.materials[mesh.material].double_sided) return s;
  const Vec2 b = sample_triangle(u);
  const Vec3 to_light = point_on_triangle(g, b.x, b.y, from_front ? g.front : -g.front) - receiver;
  s.distance = length(to_light);
  if (!(s.distance > 0)) return {};
  s.direction = to_light / s.distance;
  s.pdf = pdf_area_direct(e, entry, g, s.direction, s.distance);
  if (!(s.pdf > 0 && s.pdf < kInfinity)) return {};
  s.irradiance = emitted_radiance(scene, mesh, id.triangle, b.x, b.y) / s.pdf;
  return s;
}

/// Draws an emitter by power and a point or direction of it. Nothing comes where `irradiance` is zero.
LC_KERNEL DirectSample sample_direct(const SceneView& scene, const EmitterView& e, Vec3 receiver,
                                     const Sample4& sample) {
  if (e.entry_count() == 0 || !(e.prefix[e.entry_count()] > 0)) return {};
  const Choice choice = sample_emitter(e, 0, e.entry_count(), sample.unit_double(0));
  const auto probability = static_cast<float>(choice.probability);
  const std::uint32_t entry = choice.index;
  if (entry < e.triangle_count) return sample_area_direct(scene, e, entry, receiver, sample.unit2(1));
  DirectSample s;
  if (entry < e.triangle_count + e.point_count) {
    const PointLight& light = e.points[entry - e.triangle_count];
    const Vec3 to_light = light.position - receiver;
    s.distance = length(to_light);
    if (!(s.distance > 0)) return {};
    s.direction = to_light / s.distance;
    s.irradiance = eval_point_light(light, -s.direction) / (probability * s.distance * s.distance);
  } else if (entry < e.punctual_end()) {
    const DirectionalLight& light = e.directionals[entry - e.triangle_count - e.point_count];
    s.distance = kInfinity;
    s.direction = -light.direction;
    s.irradiance = light.irradiance / probability;
  } else {
    const EnvironmentSample sky = sample_environment(e.environment, sample.unit_double(1), sample.unit_double(2));
    s.distance = kInfinity;
    s.direction = sky.direction;
    s.pdf = sky.pdf * probability;
    if (!(s.pdf > 0)) return {};
    s.irradiance = sky.radiance / s.pdf;
  }
  return s;
}

}  // namespace lightcuts
