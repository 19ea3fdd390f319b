#include "cpu/light_set.h"

#include <fmt/format.h>

#include "kernels/light.h"
#include "kernels/surface.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

/// A spot whose edge is sharp: its inner and outer angle agree to within rounding.
constexpr float kSmallestSpotRange = 1e-6f;

bool in_reach(Vec3 p) { return is_finite(p) && max_component(absolute(p)) <= kLargestLitCoordinate; }

void require(bool good, const char* kind, std::size_t index) {
  if (good) return;
  throw Error(Code::invalid_scene,
              fmt::format("{} {} has a number that is not finite, a negative intensity or a position beyond 1e9 m; "
                          "light from that far is a directional light",
                          kind, index));
}

bool is_intensity(Vec3 v) { return is_finite(v) && min_component(v) >= 0; }

PointRecord make_record(const PointLight& light) {
  return {light.position, light.axis, light.intensity, light.cos_outer,
          1.0f / max_of(light.cos_inner - light.cos_outer, kSmallestSpotRange)};
}

}  // namespace

LightSet make_light_set(const Lights& lights) {
  LightSet set;
  set.vpls = lights.vpls;
  set.points.reserve(lights.points.size());
  set.directionals.reserve(lights.directionals.size());
  for (std::size_t i = 0; i < lights.vpls.size(); ++i) {
    const Vpl& vpl = lights.vpls[i];
    require(in_reach(vpl.position) && is_finite(vpl.axis) && is_intensity(vpl.intensity), "VPL", i);
  }
  for (const PointLight& light : lights.points) {
    require(in_reach(light.position) && is_finite(light.axis) && is_intensity(light.intensity) &&
                std::isfinite(light.cos_inner) && std::isfinite(light.cos_outer),
            "point light", set.points.size());
    set.points.push_back(make_record(light));
  }
  for (const DirectionalLight& light : lights.directionals) {
    require(is_finite(light.direction) && is_intensity(light.irradiance), "directional light", set.directionals.size());
    set.directionals.push_back({light.direction, light.irradiance});
  }
  return set;
}

}  // namespace lightcuts
