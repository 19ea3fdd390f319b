#pragma once

#include <cstring>
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
  explicit BenchScene(const char* which, std::uint64_t vpls = 2000)
      : BenchScene(which, std::strchr(which, '.') != nullptr ? load_scene(which).scene : make_builtin_scene(which),
                   vpls) {}
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
};

/// Tables of what lookups give by other rules than lookup_visibility's: of random pairs, of lit surfaces and beside edges
/// where things touch.
void compare_lookup_rules(const BenchScene& bench, int size);
/// relmse and FLIP of a picture by each rule against rays.
void compare_pictures_by_rules(const BenchScene& bench, int size);
/// Points spent evenly against more of them where the light sees more: holes, agreement and pictures by the maps.
void compare_adaptive_points(const BenchScene& bench, std::uint32_t points);
/// How much light arrives close to where a box stands on a floor.
void contact_shadows(int size);

}  // namespace lightcuts
