#include "bench_study/atlas.h"

#include <fmt/format.h>

#include "bench_frame/frame_bench.h"
#include "console.h"

namespace lightcuts::app::frame {
namespace {

Repeats milliseconds(const Json& times) {
  return {1e3 * times["wall_s"].get<double>(), 1e3 * times["low_s"].get<double>(), 1e3 * times["high_s"].get<double>(),
          times["repeats"].get<int>()};
}

}  // namespace

/// The study's largest atlas, of maps of the study's room, by its way and by ours; a GPU's work only.
void FrameBench::measure_pull_push() {
  const std::string levels = "pull-push, 3968, levels", at_once = "pull-push, 3968, at once";
  if (!on_gpu() || name_ != "study" || !parts_.numbers().empty() || !(wants(levels) || wants(at_once))) return;
  const Json found =
      study::time_gpu_pull_push(request_.device, study::maps_for_atlas(), study::kStudyAtlas, sizes_.runs);
  const auto differing = found["differing"].get<std::size_t>();
  result_.correct = result_.correct && differing == 0;
  const std::string words =
      differing == 0 ? "equal to the processor's" : fmt::format("{} texels differ  WRONG", differing);
  vpls_ = 0;
  if (wants(levels)) add_row(levels, milliseconds(found["levels"]), Json::object(), words);
  if (wants(at_once)) add_row(at_once, milliseconds(found["at_once"]), Json::object(), words);
}

}  // namespace lightcuts::app::frame
