#include "stats_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "lightcuts/version.h"

namespace lightcuts::app {
namespace {

using Json = nlohmann::ordered_json;

Json bounces_json(int bounces) { return bounces == kUnlimitedBounces ? Json("inf") : Json(bounces); }

/// 0.02f as 0.02: the shortest number that is the same float.
double shortest(float value) { return std::stod(fmt::format("{}", value)); }

int samples_of(const ShadeOptions& shade) {
  if (shade.samples > 0) return shade.samples;
  return shade.method == Method::path ? 64 : 1;
}

Json camera_json(const CameraRequest& camera) {
  const auto vector = [](Vec3 v) { return Json{shortest(v.x), shortest(v.y), shortest(v.z)}; };
  Json out = Json::object();
  if (!camera.which.empty()) out["camera"] = camera.which;
  if (camera.eye) out["eye"] = vector(*camera.eye);
  if (camera.target) out["target"] = vector(*camera.target);
  if (camera.fov_deg) out["fov"] = shortest(*camera.fov_deg);
  return out;
}

/// Every option under its name on the command line, defaults filled in.
Json options_json(const RenderRequest& request) {
  const RenderOptions& o = request.options;
  Json out{{"scene", request.scene},
           {"method", name_of(o.shade.method, kMethods)},
           {"visibility", name_of(o.shade.visibility, kVisibilities)},
           {"backend", name_of(o.backend, kBackends)},
           {"device", o.device},
           {"memory", o.memory_bytes},
           {"size", Json{o.width, o.height}},
           {"environment", request.environment ? Json(*request.environment) : Json(nullptr)},
           {"vpls", o.vpls.count},
           {"primary-lights", o.vpls.primary_lights},
           {"vpls-per-light", o.vpls.vpls_per_light},
           {"bounces", bounces_json(o.vpls.bounces)},
           {"vpl-placement", name_of(o.vpls.placement, kVplPlacements)},
           {"deposit", name_of(o.vpls.deposit, kDeposits)},
           {"deposit-distance", shortest(o.vpls.deposit_distance)},
           {"error", shortest(o.shade.error)},
           {"max-cut", o.shade.max_cut},
           {"tree", name_of(o.tree.builder, kTreeBuilders)},
           {"metric", name_of(o.tree.metric, kMetrics)},
           {"cut", name_of(o.shade.cut, kCutWalks)},
           {"ism-size", o.shade.ism_size},
           {"ism-points", o.shade.ism_points},
           {"ism-levels", o.shade.ism_levels},
           {"ism-fill", name_of(o.shade.ism_fill, kHoleFills)},
           {"ism-choice", name_of(o.shade.ism_choice, kPointChoices)},
           {"ism-depth-bits", o.shade.ism_depth_bits},
           {"min-distance", shortest(o.shade.min_distance)},
           {"samples", samples_of(o.shade)},
           {"seed", o.vpls.seed},
           {"threads", o.threads}};
  out.update(camera_json(request.camera));
  return out;
}

}  // namespace

std::string stats_json(const RenderRequest& request, const Statistics& s) {
  const Json out{
      {"version", version()},
      {"device", s.device},
      {"options", options_json(request)},
      {"scene", {{"triangles", s.scene.triangles}, {"emitters", s.scene.emitters}, {"lights", s.scene.lights}}},
      {"vpls", {{"count", s.vpls.count}, {"primary", s.vpls.primary}, {"paths", s.vpls.paths}}},
      {"tree", {{"nodes", s.tree.nodes}, {"depth", s.tree.depth}}},
      {"cut",
       {{"mean", s.cut.mean},
        {"max", s.cut.max},
        {"at_limit", s.cut.at_limit},
        {"lights_used", s.cut.lights_used},
        {"gain", s.cut.gain}}},
      {"clamped", s.clamped},
      {"shadow_maps",
       {{"count", s.shadow_maps.count},
        {"size", s.shadow_maps.size},
        {"bytes", s.shadow_maps.bytes},
        {"room", s.shadow_maps.room},
        {"rounds", s.shadow_maps.rounds}}},
      {"rays", s.rays},
      {"pairs", s.pairs},
      {"time_ms",
       {{"load", s.time_ms.load},
        {"bvh", s.time_ms.bvh},
        {"vpls", s.time_ms.vpls},
        {"tree", s.time_ms.tree},
        {"shadow_maps", s.time_ms.shadow_maps},
        {"shade", s.time_ms.shade},
        {"write", s.time_ms.write},
        {"total", s.time_ms.total}}},
      {"memory_bytes", {{"host_peak", s.memory_bytes.host_peak}, {"device_peak", s.memory_bytes.device_peak}}}};
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace lightcuts::app
