#pragma once

#include <memory>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/ray_tracer.h"
#include "cpu/simd/isa.h"
#include "cpu/vpl_tracer.h"
#include "lightcuts/scene.h"

namespace lightcuts {

/// A scene with all that its maps need.
struct MapScene {
  Scene scene;
  SceneArrays cpu_scene;
  RayTracer tracer;
  Lights lights;
  LightSet light_set;

  explicit MapScene(Scene s) : scene(prepare(std::move(s))), cpu_scene(scene), tracer(cpu_scene.view()) {}

  static Scene prepare(Scene s) {
    validate(s);
    return s;
  }
  void trace(std::uint64_t count) {
    VplOptions options;
    options.count = count;
    set(trace_vpls(cpu_scene, tracer, options));
  }
  void set(Lights l) {
    lights = std::move(l);
    light_set = make_light_set(lights);
  }
};

/// Points and maps of a scene's lights.
struct Maps {
  SurfacePoints points;
  ShadowMapSet set;

  Maps(const MapScene& scene, std::uint32_t per_map, const ShadowMapOptions& options, const LightIds& ids)
      : points(scene.cpu_scene.view(), {per_map}), set(ism_kernels(selected_isa()), points, scene.light_set, options) {
    set.add(ids);
  }

  /// Share of a light that arrives at one point.
  [[nodiscard]] float share(LightKind kind, std::uint32_t light, Vec3 at, Vec3 normal) const {
    ReceiverPacket receivers{};
    receivers.position.x[3] = at.x;
    receivers.position.y[3] = at.y;
    receivers.position.z[3] = at.z;
    receivers.ng.x[3] = normal.x;
    receivers.ng.y[3] = normal.y;
    receivers.ng.z[3] = normal.z;
    alignas(64) float shares[kPacketSize];
    set.shares(kind, light, receivers, 1u << 3, shares);
    return shares[3];
  }
};

}  // namespace lightcuts
