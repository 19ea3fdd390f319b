#pragma once

#include <cmath>

#include "oracle/shadow_map_agreement.h"

namespace lightcuts::oracle {

/// What places around a receiver on its plane are, within two texels of a map, those that a lookup compares with among them.
enum class Around {
  lit,     ///< all that light could reach
  corner,  ///< behind another surface that meets this one, so that no light could reach them
  shadow   ///< places of surfaces that other things shadow: an edge of a shadow is near
};

inline Around around(const RayTracer& tracer, const MapView& view, int size, Vec3 at, Vec3 normal) {
  Around found = Around::lit;
  const auto look = [&](Vec3 place) {
    const float off = 1e-3f + 1e-4f * length(place);
    if (!tracer.occluded(shadow_ray(place + normal * (0.2f * off), view.origin))) return;
    const bool on_surface = tracer.intersect({place + normal * off, 0, -normal, 2 * off}).valid();
    if (found != Around::shadow) found = on_surface ? Around::shadow : Around::corner;
  };
  const Vec3 local = to_local_point(view, at);
  const MapPoint<float> seen = project_paraboloid(local);
  const float half = 0.5f * static_cast<float>(size), in_front = dot(at - view.origin, normal);
  const auto texel = [&](float u) { return std::clamp(static_cast<int>((u + 1) * half), 0, size - 1); };
  for (int tap = 0; tap < kTaps; ++tap) {
    const int x = std::clamp(texel(seen.u) + tap_x(tap), 0, size - 1),
              y = std::clamp(texel(seen.v) + tap_y(tap), 0, size - 1);
    const Vec3 w = to_world(view.frame, unproject_paraboloid(texel_centre(x, size), texel_centre(y, size)));
    const float way = in_front / dot(w, normal);
    if (way > 0 && way < 2 * seen.depth) look(view.origin + w * way);
  }
  const Frame frame = make_frame(normal);
  const float width = 4 * seen.depth / static_cast<float>(size);
  for (int k = 0; k < 32 && found != Around::shadow; ++k) {
    const float angle = 0.785398f * static_cast<float>(k), far = 0.5f * width * static_cast<float>(k / 8 + 1);
    look(at + frame.x * (far * std::cos(angle)) + frame.y * (far * std::sin(angle)));
  }
  return found;
}

/// Sums of shares of places that a light reaches.
struct LitPlaces {
  double asked = 0;
  double lit = 0;    ///< by the maps
  double exact = 0;  ///< by maps of traced depths: what lookups alone lose

  [[nodiscard]] double lit_share() const { return asked > 0 ? lit / asked : 1; }
  [[nodiscard]] double exact_share() const { return asked > 0 ? exact / asked : 1; }
};

/// What becomes of places that a light reaches with no shadow's edge near.
struct LitSurfaces {
  LitPlaces clear, corners;  ///< with nothing around, and next to a surface that meets theirs
};

/// Asks the maps of every `step`-th VPL at `per_light` places that it reaches with no shadow's edge near.
inline LitSurfaces measure_lit_surfaces(const ShadowMapSet& maps, const LightSet& lights, const SceneArrays& scene,
                                        const RayTracer& tracer, std::size_t step, int per_light) {
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
      const Around near = around(tracer, view, size, p.position, p.normal);
      if (near == Around::shadow) continue;
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
      LitPlaces& places = near == Around::lit ? result.clear : result.corners;
      places.asked += 1;
      places.lit += share[0];
      places.exact += exact_map_share(tracer, view, size, p.position, p.normal);
    }
  }
  return result;
}

}  // namespace lightcuts::oracle
