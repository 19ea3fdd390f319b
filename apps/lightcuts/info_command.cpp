#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "scene_source.h"
#include "text.h"

namespace lightcuts::app {
namespace {

using Json = nlohmann::ordered_json;

/// What Embree's tree takes for a triangle [bytes], an estimate, not measured; an estimate for a plan, no promise.
constexpr std::uint64_t kBvhBytesPerTriangle = 110;

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

std::uint64_t mesh_bytes(const Mesh& mesh) {
  return bytes_of(mesh.positions) + bytes_of(mesh.normals) + bytes_of(mesh.texcoords[0]) + bytes_of(mesh.texcoords[1]) +
         bytes_of(mesh.colors) + bytes_of(mesh.triangles);
}

std::uint64_t environment_bytes(const Scene& scene) {
  if (!scene.environment || scene.environment->image == nullptr) return 0;
  std::uint64_t bytes = 0;
  for (const Channel& channel : scene.environment->image->channels) bytes += bytes_of(channel.values);
  return bytes;
}

std::uint64_t memory_estimate(const Scene& scene) {
  std::uint64_t bytes = environment_bytes(scene);
  for (const TextureImage& image : scene.images) bytes += bytes_of(image.texels);
  for (const Mesh& mesh : scene.meshes) bytes += mesh_bytes(mesh) + kBvhBytesPerTriangle * mesh.triangles.size();
  return bytes + bytes_of(scene.instances) + bytes_of(scene.materials);
}

bool emits(const Material& material) {
  return material.emission.x > 0 || material.emission.y > 0 || material.emission.z > 0;
}

/// Triangles that emit, each instance counted.
std::uint64_t emissive_triangles(const Scene& scene) {
  std::uint64_t count = 0;
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    if (emits(scene.materials[mesh.material])) count += mesh.triangles.size();
  }
  return count;
}

std::uint64_t stored_triangles(const Scene& scene) {
  std::uint64_t count = 0;
  for (const Mesh& mesh : scene.meshes) count += mesh.triangles.size();
  return count;
}

Json camera_json(const Camera& camera, std::size_t index) {
  const Affine& m = camera.world_from_camera;
  Json out{{"index", index},
           {"name", camera.name},
           {"eye", Json{m.origin.x, m.origin.y, m.origin.z}},
           {"direction", Json{-m.z.x, -m.z.y, -m.z.z}}};
  if (camera.orthographic_height > 0) {
    out["orthographic_height"] = camera.orthographic_height;
  } else {
    out["fov"] = camera.vertical_fov_rad * 180 / kPi;
  }
  if (camera.aspect > 0) out["aspect"] = camera.aspect;
  return out;
}

Json lights_json(const Scene& scene) {
  const auto spots =
      static_cast<std::size_t>(std::count_if(scene.point_lights.begin(), scene.point_lights.end(),
                                             [](const PointLight& light) { return light.cos_outer > -1; }));
  const char* environment = !scene.environment ? "none" : scene.environment->image ? "picture" : "constant";
  return {{"point", scene.point_lights.size() - spots},
          {"spot", spots},
          {"directional", scene.directional_lights.size()},
          {"environment", environment}};
}

Json bounds_json(const Scene& scene) {
  const Box box = scene_bounds(scene);
  if (is_empty(box)) return nullptr;
  return {{"lo", Json{box.lo.x, box.lo.y, box.lo.z}}, {"hi", Json{box.hi.x, box.hi.y, box.hi.z}}};
}

Json scene_json(const std::string& spec, const LoadedScene& loaded) {
  const Scene& scene = loaded.scene;
  Json textures = Json::array();
  for (const TextureImage& image : scene.images) {
    textures.push_back(
        {{"name", image.name}, {"width", image.width}, {"height", image.height}, {"channels", image.channels}});
  }
  Json cameras = Json::array();
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) cameras.push_back(camera_json(scene.cameras[i], i));
  const auto materials_that_emit =
      static_cast<std::size_t>(std::count_if(scene.materials.begin(), scene.materials.end(), emits));
  return {{"scene", spec},
          {"triangles", drawn_triangle_count(scene)},
          {"stored_triangles", stored_triangles(scene)},
          {"meshes", scene.meshes.size()},
          {"instances", scene.instances.size()},
          {"materials", scene.materials.size()},
          {"textures", textures},
          {"emitters", {{"materials", materials_that_emit}, {"triangles", emissive_triangles(scene)}}},
          {"lights", lights_json(scene)},
          {"emits_light", emits_light(scene)},
          {"cameras", cameras},
          {"size", scene.width > 0 && scene.height > 0 ? Json{scene.width, scene.height} : Json(nullptr)},
          {"bounds", bounds_json(scene)},
          {"memory_bytes", memory_estimate(scene)},
          {"warnings", loaded.warnings}};
}

void print_line(const char* name, const std::string& text) { print_result(fmt::format("{:<12} {}", name, text)); }

void print_cameras(const Scene& scene) {
  if (scene.cameras.empty()) print_line("cameras", "none; one that frames the scene will be used");
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const Camera& camera = scene.cameras[i];
    const Vec3 eye = camera.world_from_camera.origin;
    const std::string lens = camera.orthographic_height > 0
                                 ? fmt::format("orthographic, {:.3g} m high", camera.orthographic_height)
                                 : fmt::format("{:.1f} degrees", camera.vertical_fov_rad * 180 / kPi);
    print_line(i == 0 ? "cameras" : "",
               fmt::format("{}: '{}' at {:.3g}, {:.3g}, {:.3g} m, {}", i, camera.name, eye.x, eye.y, eye.z, lens));
  }
}

void print_textures(const Scene& scene) {
  if (scene.images.empty()) print_line("textures", "none");
  for (std::size_t i = 0; i < scene.images.size(); ++i) {
    const TextureImage& image = scene.images[i];
    print_line(i == 0 ? "textures" : "",
               fmt::format("{}x{}x{} {}", image.width, image.height, image.channels, image.name));
  }
}

void print_lights(const Scene& scene) {
  const Json lights = lights_json(scene);
  print_line("emitters", fmt::format("{} triangles", grouped(emissive_triangles(scene))));
  print_line("lights", fmt::format("{} point, {} spot, {} directional, environment {}",
                                   lights["point"].get<std::size_t>(), lights["spot"].get<std::size_t>(),
                                   lights["directional"].get<std::size_t>(), lights["environment"].get<std::string>()));
  if (!emits_light(scene)) print_line("", "nothing emits light: render it with --environment 1");
}

void print_scene(const LoadedScene& loaded) {
  const Scene& scene = loaded.scene;
  const std::uint64_t drawn = drawn_triangle_count(scene), stored = stored_triangles(scene);
  print_line("triangles",
             grouped(drawn) + (stored == drawn ? "" : fmt::format(" drawn, {} in memory", grouped(stored))));
  print_line("meshes", fmt::format("{} in {} instances, {} materials", grouped(scene.meshes.size()),
                                   grouped(scene.instances.size()), grouped(scene.materials.size())));
  print_textures(scene);
  print_lights(scene);
  print_cameras(scene);
  if (scene.width > 0 && scene.height > 0) print_line("size", fmt::format("{}x{} pixels", scene.width, scene.height));
  const Box box = scene_bounds(scene);
  print_line("bounds", is_empty(box) ? "empty"
                                     : fmt::format("{:.4g}, {:.4g}, {:.4g} to {:.4g}, {:.4g}, {:.4g} m", box.lo.x,
                                                   box.lo.y, box.lo.z, box.hi.x, box.hi.y, box.hi.z));
  print_line("memory", fmt::format("about {}, its ray-tracing tree included", readable_bytes(memory_estimate(scene))));
}

int run(const std::string& spec, bool json) {
  const LoadedScene loaded = open_scene(spec);
  if (json) {
    print_result(scene_json(spec, loaded).dump(2, ' ', false, Json::error_handler_t::replace));
    return kDone;
  }
  for (const std::string& warning : loaded.warnings) print_warning(warning);
  print_scene(loaded);
  return kDone;
}

}  // namespace

void add_info_command(CLI::App& program, Action& action) {
  CLI::App* command = program.add_subcommand("info", "Say what is in a scene");
  command->footer(R"(
Examples:
  lightcuts info room.glb
  lightcuts info builtin:study --json

Exit status: 0 it can be opened, 2 wrong usage, 3 it cannot.)");
  auto spec = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  command->add_option("SCENE", *spec, kSceneHelp)->required()->option_text("(required)");
  command->add_flag("--json", *json, "one JSON object instead of lines");
  command->callback([spec, json, &action] { action = [spec, json] { return run(*spec, *json); }; });
}

}  // namespace lightcuts::app
