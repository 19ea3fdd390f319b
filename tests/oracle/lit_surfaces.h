#pragma once

#include <cmath>

#include "oracle/shadow_map_agreement.h"

namespace lightcuts::oracle {

/// What becomes of places that a light reaches with no shadow's edge near.
struct LitSurfaces {
  double asked = 0;
  double lit = 0;        ///< sum of their shares
  double by_itself = 0;  ///< what is missing where the surface shadows itself (acne)
  double exact = 0;      ///< sum of shares by a map of traced depths: what lookups alone lose

  [[nodiscard]] double lit_share() const { return lit / asked; }
  [[nodiscard]] double acne() const { return by_itself / asked; }
  [[nodiscard]] double exact_share() const { return exact / asked; }
};

/// Where the depth lies that a map holds in the texel of a receiver.
inline Vec3 stored_place(const ShadowMapSet& maps, const MapView& view, std::uint32_t light, Vec3 receiver) {
  const int size = maps.maker().options().size;
  const MapPoint<float> at = project_paraboloid(to_local_point(view, receiver));
  const auto texel = [size](float u) {
    return std::clamp(static_cast<int>((u + 1) * 0.5f * static_cast<float>(size)), 0, size - 1);
  };
  const int x = texel(at.u), y = texel(at.v);
  const std::uint32_t code = maps.codes_of(LightKind::vpl, light)[static_cast<std::size_t>(y * size + x)];
  const Vec3 w = to_world(view.frame, unproject_paraboloid(texel_centre(x, size), texel_centre(y, size)));
  return view.origin + w * (static_cast<float>(code) * view.far / kDepthSteps<std::uint16_t>);
}

/// Asks the maps of every `step`-th VPL at `per_light` places that it reaches, of which no place two texels around, on
/// their plane, is hidden.
inline LitSurfaces measure_lit_surfaces(const ShadowMapSet& maps, const LightSet& lights, const SceneArrays& scene,
                                        const RayTracer& tracer, std::size_t step, int per_light, bool exact = false) {
  ReceiverSampler sampler(scene.view(), 3);
  LitSurfaces result;
  const int size = maps.maker().options().size;
  for (std::size_t light = 0; light < lights.vpls.size(); light += step) {
    const auto id = static_cast<std::uint32_t>(light);
    const Vpl& vpl = lights.vpls[light];
    const Vec3 target = offset_point(vpl.position, vpl.axis);
    const MapView view = maps.view_of(LightKind::vpl, id);
    for (int found = 0, tries = 0; found < per_light && tries < 60 * per_light; ++tries) {
      const auto p = sampler.draw();
      const Vec3 to_light = target - p.position;
      const float distance = length(to_light);
      if (dot(to_light, vpl.axis) >= -0.05f * distance || dot(to_light, p.normal) <= 0.05f * distance) continue;
      if (tracer.occluded(shadow_ray(p.position, target))) continue;
      if (at_shadow_edge(tracer, view, size, p.position, p.normal, true)) continue;
      ReceiverPacket packet{};
      packet.position.x[0] = p.position.x;
      packet.position.y[0] = p.position.y;
      packet.position.z[0] = p.position.z;
      packet.ng.x[0] = p.normal.x;
      packet.ng.y[0] = p.normal.y;
      packet.ng.z[0] = p.normal.z;
      alignas(64) float share[kPacketSize];
      maps.shares(LightKind::vpl, id, packet, 1, share);
      ++found;
      result.asked += 1;
      result.lit += share[0];
      const float width = 4 * distance / static_cast<float>(size);
      // What hides it lies within a texel's width of its own plane.
      const Vec3 stored = stored_place(maps, view, id, p.position);
      if (std::abs(dot(p.normal, stored - p.position)) < width) result.by_itself += 1 - share[0];
      if (exact) result.exact += exact_map_share(tracer, view, size, p.position, p.normal);
    }
  }
  return result;
}

}  // namespace lightcuts::oracle
