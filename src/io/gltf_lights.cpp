// What a node carries beside meshes: lights and cameras.

#include "io/gltf_lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lightcuts::gltf {
namespace {

/// A spot narrower than this between its two angles is given this much, so that its falloff stays a function.
constexpr double kSmallestFalloff = 1e-4;

Vec3 read_intensity(const JsonValue& light, Context& context) {
  std::array<float, 3> color{1, 1, 1};
  if (const JsonValue member = light.find("color")) member.numbers(color.data(), color.size());
  const auto intensity = static_cast<float>(light.find("intensity").number_or(1));
  const Vec3 value = Vec3{color[0], color[1], color[2]} * intensity;
  if (min_component(value) < 0)
    context.warnings.add_at(light, "negative light", "negative light was taken for none.", kToldPlaces);
  return max_of(value, Vec3{0, 0, 0});
}

void read_cone(const JsonValue& spot, Context& context, PointLight& out) {
  const double outer = spot.find("outerConeAngle").number_or(kPi / 4);
  const double inner = spot.find("innerConeAngle").number_or(0);
  const double right_angle = kPi / 2;
  const double safe_outer = std::clamp(outer, kSmallestFalloff, right_angle);
  const double safe_inner = std::clamp(inner, 0.0, safe_outer - kSmallestFalloff);
  if (outer != safe_outer || inner < 0 || inner >= outer) {
    context.warnings.add_at(
        spot, "cone",
        fmt::format("cone angles {} and {}: expected 0 <= inner < outer <= pi/2; {} and {} are used.", inner, outer,
                    safe_inner, safe_outer),
        kToldPlaces);
  }
  out.cos_outer = static_cast<float>(std::cos(safe_outer));
  out.cos_inner = std::max(static_cast<float>(std::cos(safe_inner)), std::nextafter(out.cos_outer, 2.0f));
}

bool read_lens(const JsonValue& camera, Camera& out) {
  const std::string type = camera.require("type").string();
  if (type == "perspective") {
    const JsonValue lens = camera.require("perspective");
    const double angle = lens.require("yfov").number();
    out.vertical_fov_rad = static_cast<float>(angle);
    out.aspect = static_cast<float>(lens.find("aspectRatio").number_or(0));
    return out.vertical_fov_rad > 0 && out.vertical_fov_rad < kPi && out.aspect >= 0;
  }
  if (type == "orthographic") {
    const JsonValue lens = camera.require("orthographic");
    const double half_width = std::abs(lens.require("xmag").number());
    const double half_height = std::abs(lens.require("ymag").number());
    out.orthographic_height = static_cast<float>(2 * half_height);
    out.aspect = half_height > 0 ? static_cast<float>(half_width / half_height) : 0;
    return out.orthographic_height > 0 && std::isfinite(out.orthographic_height) && std::isfinite(out.aspect) &&
           out.aspect > 0;
  }
  return false;
}

}  // namespace

void add_light(const JsonValue& reference, const Affine& world_from_light, Context& context, Scene& scene) {
  const JsonValue lights = context.document.root().find("extensions").find("KHR_lights_punctual").find("lights");
  const JsonValue light = reference.follow(lights, "a light");
  const std::string type = light.require("type").string();
  const Vec3 intensity = read_intensity(light, context);
  if (light.find("range")) {
    context.warnings.add_at(light, "range", "the range of lights is ignored: light falls off as physics has it.");
  }
  if (type == "directional") {
    scene.directional_lights.push_back({-world_from_light.z, intensity});
  } else if (type == "point" || type == "spot") {
    PointLight out;
    out.position = world_from_light.origin;
    out.intensity = intensity;
    out.axis = -world_from_light.z;
    if (type == "spot") read_cone(light.require("spot"), context, out);
    scene.point_lights.push_back(out);
  } else {
    context.warnings.add_at(light, "light type",
                            fmt::format("\"{}\" is no type of light; the light was left out.", readable_name(type)),
                            kToldPlaces);
  }
}

void add_camera(const JsonValue& reference, const Affine& world_from_camera, const std::string& node_name,
                Context& context, Scene& scene) {
  const JsonValue camera = reference.follow(context.array("cameras"), "a camera");
  Camera out;
  out.name = node_name.empty() ? camera.name() : node_name;
  if (out.name.empty()) out.name = fmt::format("camera {}", scene.cameras.size());
  out.world_from_camera = world_from_camera;
  if (!read_lens(camera, out)) {
    context.warnings.add_at(camera, "camera", "the type, angle or size is out of range; the camera was left out.",
                            kToldPlaces);
    return;
  }
  scene.cameras.push_back(out);
}

}  // namespace lightcuts::gltf
