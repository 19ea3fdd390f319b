// Small work: pictures of few pixels and lights, and the single stages that have goals of their own.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "bench_frame/frame_bench.h"
#include "bench_frame/rays.h"

namespace lightcuts::app::frame {
namespace {

constexpr int kSide = 64;  ///< of small pictures [pixels]
constexpr std::uint64_t kFewLights = 64;

}  // namespace

/// Of the clock, for what is small is mostly what stands around the device's work; on a GPU the processor's time beside
/// it.
void FrameBench::measure_small_work() {
  struct Kind {
    const char* stage;
    Visibility visibility;
  };
  constexpr Kind kinds[] = {
      {"small, none", Visibility::none}, {"small, ism", Visibility::ism}, {"small, rays", Visibility::rays}};
  if (stopped() || !parts_.wants_lights(kFewLights)) return;
  if (!parts_.wants_any_stage({kinds[0].stage, kinds[1].stage, kinds[2].stage})) return;
  use(kFewLights);
  make_lights();
  std::unique_ptr<Backend> cpu;
  if (on_gpu()) {
    cpu = make_cpu_backend(request_.threads);
    cpu->set_scene(scene_, {});
    trace(*cpu, kFewLights);
    cpu->build_light_tree({}, {});
  }
  for (const Kind& kind : kinds) {
    if (!wants(kind.stage)) continue;
    const auto timed = [&](Backend& backend) {
      return time({5 * sizes_.runs, 0.25 * sizes_.longest_s}, [&] {
        Statistics s;
        backend.shade(camera_, kSide, kSide, options(Method::lightcuts, kind.visibility), 0, s, {});
        return 0.0;
      });
    };
    const Repeats own = timed(*backend_);
    Json more{{"clock", "wall"}, {"side_px", kSide}};
    std::string words = fmt::format("{0}x{0} pixels, by the clock", kSide);
    if (cpu) {
      const Repeats by_cpu = timed(*cpu);
      more["cpu_ms"] = by_cpu.median;
      words += fmt::format("; on the CPU {:.3f} ms", by_cpu.median);
    }
    add_row(kind.stage, own, more, words);
  }
}

/// Of all lights' maps with their pull-push; the points on the surfaces are left out where they are timed by
/// themselves.
void FrameBench::measure_making_of_maps() {
  constexpr double kLights = 65536;
  const std::string stage = "maps, 65536";
  if (!wants(stage) || !parts_.wants_lights(sizes_.map_lights)) return;
  use(sizes_.map_lights);
  make_lights();
  Statistics s;
  const Repeats times = time(effort(), [&] {
    s = {};
    backend_->forget_maps();
    backend_->shade(camera_, kSide, kSide, options(Method::instant_radiosity, Visibility::ism), 0, s, {});
    const StageTimes t = backend_->stage_times();
    const double ms = t.shadow_maps > 0 ? t.shadow_maps - t.points : s.time_ms.shadow_maps;
    return ms * kLights / static_cast<double>(std::max<std::uint64_t>(1, s.shadow_maps.count));
  });
  add_row(stage, times, {{"shadow_maps", s.shadow_maps.count}},
          fmt::format("{} maps{} in {} rounds, scaled to 65536", s.shadow_maps.count, on_gpu() ? "" : " and the points",
                      s.shadow_maps.rounds));
}

void FrameBench::measure_incoherent_rays() {
  const std::string stage = "rays, incoherent";
  if (!wants(stage) || !parts_.numbers().empty()) return;
  const IncoherentRays rays{sizes_.rays, 2, sizes_.runs};
  const Repeats times =
      on_gpu() ? time_on_gpu(request_.device, scene_, rays) : time_on_cpu(request_.threads, scene_, rays);
  const double per_second = 1e3 * static_cast<double>(rays.count) / times.median;
  vpls_ = 0;
  add_row(stage, times, {{"rays", rays.count}, {"rays_per_s", per_second}},
          fmt::format("{} rays, {:.3f} G rays/s", rays.count, 1e-9 * per_second));
}

}  // namespace lightcuts::app::frame
