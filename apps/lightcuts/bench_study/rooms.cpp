#include "bench_study/rooms.h"

#include "lightcuts/compare.h"
#include "render/memory.h"

namespace lightcuts::app::study {

const Scene& study_room() {
  static const Scene room = [] {
    Scene scene = make_builtin_scene("study");
    validate(scene);
    return scene;
  }();
  return room;
}

VplOptions study_lights(std::uint64_t n, std::uint64_t seed) {
  VplOptions options;
  options.primary_lights = n;
  options.vpls_per_light = n;
  options.bounces = 1;
  options.seed = seed;
  return options;
}

ShadeOptions shade_options(Method method, Visibility visibility) {
  ShadeOptions options;
  options.method = method;
  options.visibility = visibility;
  return options;
}

std::uint64_t memory_budget() { return default_memory_budget(); }

Time stage_time(const Stopwatch& watch, double device_ms) {
  return device_ms > 0 ? Time{device_ms / 1e3, device_ms / 1e3} : watch.elapsed();
}

double picture_ms(const StageTimes& times) { return times.shade > 0 ? times.shade + times.points : 0; }

double mean_error(const Image& image, const Image& reference) { return compare(image, reference).mean_relative_error; }

}  // namespace lightcuts::app::study
