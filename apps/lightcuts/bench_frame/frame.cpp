#include <algorithm>
#include <filesystem>

#include "bench.h"
#include "bench_frame/frame_bench.h"
#include "console.h"
#include "lightcuts/io.h"
#include "scene_source.h"

namespace lightcuts::app {
namespace frame {
namespace {

/// The numbers that were asked for and that no list has.
std::vector<std::uint64_t> other_numbers(const Parts& parts, const Sizes& sizes) {
  std::vector<std::uint64_t> others;
  for (const std::uint64_t number : parts.numbers()) {
    const auto is_in = [&](const std::vector<std::uint64_t>& list) {
      return std::find(list.begin(), list.end(), number) != list.end();
    };
    if (!is_in(sizes.vpls) && !is_in(sizes.study_lights) && !is_in(sizes.more_lights)) others.push_back(number);
  }
  return others;
}

}  // namespace

void FrameBench::measure_scene(const std::string& name, const std::string& spec) {
  if (stopped()) return;
  name_ = name;
  scene_ = open_scene(spec).scene;
  camera_ = select_camera(scene_, "");
  backend_->set_scene(scene_, {});
  for (const std::uint64_t vpls : sizes_.vpls) measure_stages(vpls);
  // What has goals comes first: a run that is stopped has them.
  measure_crossing("crossing, ism", Again::pixels);
  measure_crossing("crossing, ism, maps too", Again::maps);
  measure_making_of_maps();
  measure_incoherent_rays();
  measure_pull_push();
  measure_small_work();
  for (const std::uint64_t vpls : other_numbers(parts_, sizes_)) measure_with_visibility(vpls);
  for (const std::uint64_t vpls : sizes_.study_lights) measure_as_the_study(vpls);
  for (const std::uint64_t vpls : sizes_.more_lights) measure_curve(vpls);
}

BenchResult FrameBench::run() {
  if (parts_.wants_scene("study")) measure_scene("study", "builtin:study");
  const std::filesystem::path rooms = request_.scenes.empty() ? "../shared/scenes/rooms" : request_.scenes;
  const std::filesystem::path ajar = rooms / "veach-ajar" / "scene.gltf";
  if (parts_.wants_scene("veach-ajar")) {
    if (std::filesystem::exists(ajar)) {
      measure_scene("veach-ajar", ajar.string());
    } else {
      print_note("veach-ajar is not in " + rooms.string() + ": left out");
    }
  }
  if (result_.complete && result_.json["rows"].empty()) {
    print_warning("each --part names something, but no measurement is in all of them");
  }
  print_goals();
  return std::move(result_);
}

}  // namespace frame

BenchResult run_frame(const BenchRequest& request) {
  const Interruption interruption;
  return frame::FrameBench(request).run();
}

}  // namespace lightcuts::app
