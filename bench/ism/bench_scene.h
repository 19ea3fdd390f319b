#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "backend/scene_arrays.h"
#include "cpu/light_set.h"
#include "cpu/ray_tracer.h"
#include "cpu/vpl_tracer.h"
#include "lightcuts/io.h"
#include "lightcuts/scene.h"

namespace lightcuts {

/// A scene with lights to make maps of.
struct BenchScene {
  std::string name;
  Scene scene;
  std::unique_ptr<SceneArrays> cpu_scene;
  std::unique_ptr<RayTracer> tracer;
  Lights all_lights;
  LightSet lights;

  /// `which`: a name of a built-in scene, or a file.
  BenchScene(const std::string& which, std::uint64_t vpls)
      : BenchScene(title_of(which), is_file(which) ? load_scene(which).scene : make_builtin_scene(which), vpls) {}
  BenchScene(std::string title, Scene s, std::uint64_t vpls) : name(std::move(title)), scene(std::move(s)) {
    if (!emits_light(scene)) scene.environment = Environment{};
    validate(scene);
    cpu_scene = std::make_unique<SceneArrays>(scene);
    tracer = std::make_unique<RayTracer>(cpu_scene->view());
    VplOptions options;
    options.count = vpls;
    all_lights = trace_vpls(*cpu_scene, *tracer, options);
    lights = make_light_set(all_lights);
  }

 private:
  static bool is_file(const std::string& which) { return which.find('.') != std::string::npos; }
  /// Scenes often lie in a folder of their name.
  static std::string title_of(const std::string& which) {
    return is_file(which) ? std::filesystem::path(which).parent_path().filename().string() : which;
  }
};

}  // namespace lightcuts
