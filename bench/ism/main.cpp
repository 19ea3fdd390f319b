// What imperfect shadow maps are worth: agreement with rays by map size and points, and what a map costs in rays.
// Usage: bench_ism agreement|lit|speed|scaling SCENE...   (a name of a built-in scene, or a file)
//        bench_ism rules|rule-pictures SCENE...           (other rules of a lookup)
//        bench_ism contact TEXELS...                      (the same where a box stands on a floor)
//        bench_ism adaptive SCENE...                      (more points where a light sees more)
//        bench_ism map SCENE LIGHT OUT.png                (a map before and after pull-push, in false colour)

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <memory>

#include "bench_scene.h"
#include "cpu/simd/isa.h"
#include "lightcuts/image.h"
#include "lightcuts/io.h"
#include "oracle/lit_surfaces.h"
#include "oracle/shadow_map_agreement.h"

namespace lightcuts {
namespace {

/// Processor time of this thread [s]: other programs on the machine do not count.
double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void print_agreement(const BenchScene& bench, std::uint32_t points, const ShadowMapOptions& options, const char* note,
                     bool exact = false) {
  constexpr std::size_t step = 20;
  const SurfacePoints surface(bench.cpu_scene->view(), {points});
  ShadowMapSet maps(ism_kernels(selected_isa()), surface, bench.lights, options);
  maps.add(every_light(bench.lights, 0, step));
  const oracle::Agreement a =
      oracle::measure_agreement(maps, bench.lights, *bench.cpu_scene, *bench.tracer, step, 160, true, exact);
  const double wrong = a.wrongly_lit + a.wrongly_dark;
  fmt::print("| {} | {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.0f} of {:.0f} |\n", bench.name,
             options.size, points, note, 100 * a.agreement(), 100 * a.balanced(), 100 * a.wrongly_lit / a.pairs,
             100 * a.wrongly_dark / a.pairs, 100 * a.always_lit(), 100 * a.wrong_at_edges / wrong,
             100 * a.at_edges / a.pairs);
  std::fflush(stdout);
}

/// Every row compares at least 14 000 pairs of a VPL and a point that faces it with traced rays.
void agreement(const BenchScene& bench) {
  for (const int size : {32, 64, 128}) {
    for (const std::uint32_t points : {1000u, 8000u, 64000u}) {
      ShadowMapOptions options;
      options.size = size;
      print_agreement(bench, points, options, "edges, 2 levels");
    }
    ShadowMapOptions options;
    options.size = size;
    print_agreement(bench, 8000, options, "exact depths", true);
  }
  ShadowMapOptions options;
  options.levels = 0;
  print_agreement(bench, 8000, options, "holes stay");
  options.levels = 2;
  options.fill = HoleFill::mean;
  print_agreement(bench, 8000, options, "study's mean, 2 levels");
  options = {};
  options.depth_bits = 32;
  print_agreement(bench, 8000, options, "32 bits");
  options = {};
  options.choice = PointChoice::noise;
  print_agreement(bench, 8000, options, "study's noise");
}

/// Seconds that a shadow ray between random points of the scene takes, and that a map takes; the best of several rounds,
/// on one thread.
void speed(const BenchScene& bench) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  oracle::ReceiverSampler sampler(bench.cpu_scene->view(), 1);
  std::vector<Ray> rays;
  rays.reserve(20000);
  for (int i = 0; i < 20000; ++i) rays.push_back(shadow_ray(sampler.draw().position, sampler.draw().position));
  const SurfacePoints points(bench.cpu_scene->view(), {8000});
  ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, {});
  const LightIds ids = every_light(bench.lights, 0, 80);
  constexpr int rounds = 40;
  std::vector<double> ray, map, ratio;
  std::size_t hidden = 0;
  for (int round = 0; round < rounds; ++round) {
    double start = thread_seconds();
    for (const Ray& r : rays) hidden += bench.tracer->occluded(r) ? 1 : 0;
    ray.push_back((thread_seconds() - start) / static_cast<double>(rays.size()));
    maps.clear();
    start = thread_seconds();
    maps.add(ids);
    map.push_back((thread_seconds() - start) / static_cast<double>(maps.map_count()));
    ratio.push_back(map.back() / ray.back());
  }
  for (auto* v : {&ray, &map, &ratio}) std::sort(v->begin(), v->end());
  fmt::print(
      "{}: a map of 64x64 texels and 8000 points takes {:.3f} ms, an incoherent shadow ray {:.3f} us ({:.0f} % "
      "hidden), medians of {} rounds: a map costs {:.0f} rays (quartiles {:.0f} and {:.0f}; best times {:.0f})\n",
      bench.name, map[rounds / 2] * 1e3, ray[rounds / 2] * 1e6,
      100.0 * static_cast<double>(hidden) / (rounds * static_cast<double>(rays.size())), rounds, ratio[rounds / 2],
      ratio[rounds / 4], ratio[3 * rounds / 4], map[0] / ray[0]);
}

/// Milliseconds a map on one thread by texels, points and how many maps are made; the best of several rounds.
void scaling(const BenchScene& bench) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  fmt::print("{}\n| texels | points | maps | ms a map |\n|---:|---:|---:|---:|\n", bench.name);
  const auto row = [&](int size, std::uint32_t per_map, std::size_t step) {
    const SurfacePoints points(bench.cpu_scene->view(), {per_map});
    ShadowMapOptions options;
    options.size = size;
    ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
    double best = 1e9;
    for (int round = 0; round < 5; ++round) {
      maps.clear();
      const double start = thread_seconds();
      maps.add(every_light(bench.lights, 0, step));
      best = std::min(best, (thread_seconds() - start) / static_cast<double>(maps.map_count()));
    }
    fmt::print("| {} | {} | {} | {:.3f} |\n", size, per_map, maps.map_count(), best * 1e3);
  };
  for (const int size : {16, 32, 64, 128, 256}) row(size, 8000, 100);
  for (const std::uint32_t points : {1000u, 2000u, 4000u, 16000u, 32000u, 64000u}) row(64, points, 100);
  for (const std::size_t step : {400u, 25u, 6u}) row(64, 8000, step);
}

/// How much of the light arrives at places that it reaches with no shadow's edge near, in %.
void lit(const BenchScene& bench) {
  for (const int size : {16, 32, 64, 128, 256}) {
    for (const std::uint32_t points : {8000u, 64000u}) {
      const SurfacePoints surface(bench.cpu_scene->view(), {points});
      ShadowMapOptions options;
      options.size = size;
      ShadowMapSet maps(ism_kernels(selected_isa()), surface, bench.lights, options);
      maps.add(every_light(bench.lights, 0, 40));
      const oracle::LitSurfaces l =
          oracle::measure_lit_surfaces(maps, bench.lights, *bench.cpu_scene, *bench.tracer, 40, 60, true);
      fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} |\n", bench.name, size, points, 100 * l.lit_share(),
                 100 * l.acne(), 100 * l.exact_share());
      std::fflush(stdout);
    }
  }
}

/// Draws one VPL's map of 128x128 texels from 1000 points three times, enlarged: as drawn, its holes filled by the study's
/// mean, and by surfaces kept apart; 2 coarser levels. Nearer is darker; texels with nothing are grey.
void picture(const BenchScene& bench, std::uint32_t light, const char* path) {
  constexpr int size = 128, zoom = 3, gap = 12, panels = 3;
  constexpr int width = panels * size * zoom + (panels - 1) * gap, height = size * zoom;
  const SurfacePoints points(bench.cpu_scene->view(), {1000});
  std::vector<float> values(static_cast<std::size_t>(width) * height, std::numeric_limits<float>::quiet_NaN());
  float farthest = 0;
  for (int panel = 0; panel < panels; ++panel) {
    ShadowMapOptions options;
    options.size = size;
    options.levels = panel == 0 ? 0 : 2;
    options.fill = panel == 1 ? HoleFill::mean : HoleFill::edges;
    ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
    maps.add({{light}, {}, {}});
    const std::vector<std::uint32_t> codes = maps.codes_of(LightKind::vpl, light);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < size * zoom; ++x) {
        const std::uint32_t code = codes[static_cast<std::size_t>(y / zoom * size + x / zoom)];
        if (code == kNoDepth<std::uint16_t>) continue;
        farthest = std::max(farthest, static_cast<float>(code));
        values[static_cast<std::size_t>(y * width + panel * (size * zoom + gap) + x)] = static_cast<float>(code);
      }
    }
  }
  save_png(path, false_colour(width, height, values, 0, farthest).picture);
}

}  // namespace
}  // namespace lightcuts

int main(int argc, char** argv) {
  using namespace lightcuts;
  try {
    if (argc < 3) {
      std::fputs(
          "usage: bench_ism agreement|lit|speed|scaling|rules|rule-pictures|adaptive SCENE... | contact TEXELS... | "
          "map SCENE LIGHT OUT.png\n",
          stderr);
      return 2;
    }
    if (std::strcmp(argv[1], "map") == 0 && argc == 5) {
      picture(BenchScene(argv[2]), static_cast<std::uint32_t>(std::atoi(argv[3])), argv[4]);
      return 0;
    }
    if (std::strcmp(argv[1], "scaling") == 0) {
      for (int i = 2; i < argc; ++i) scaling(BenchScene(argv[i]));
      return 0;
    }
    if (std::strcmp(argv[1], "rules") == 0) {
      fmt::print(
          "| scene | texels | rule | lit % | agreement % | balanced % | wrongly lit % | wrongly dark % "
          "|\n|---|---|---|---|---|---|---|---|\n");
      for (int i = 2; i < argc; ++i) {
        const BenchScene bench(argv[i]);
        for (const int size : {16, 32, 64, 128}) compare_lookup_rules(bench, size);
      }
      return 0;
    }
    if (std::strcmp(argv[1], "rule-pictures") == 0) {
      fmt::print("| scene | texels | rule | relmse / FLIP | signed error |\n|---|---|---|---|---|\n");
      for (int i = 2; i < argc; ++i) {
        const BenchScene bench(argv[i], 1000);
        for (const int size : {16, 64}) compare_pictures_by_rules(bench, size);
      }
      return 0;
    }
    if (std::strcmp(argv[1], "adaptive") == 0) {
      fmt::print(
          "| scene | points | spent | used | holes % | agreement % | balanced % | wrongly lit % | wrongly dark % | "
          "relmse / FLIP "
          "|\n|---|---|---|---|---|---|---|---|---|---|\n");
      for (int i = 2; i < argc; ++i) {
        const BenchScene bench(argv[i], 1000);
        for (const std::uint32_t points : {2000u, 8000u}) compare_adaptive_points(bench, points);
      }
      return 0;
    }
    if (std::strcmp(argv[1], "contact") == 0) {
      fmt::print(
          "| texels | rule | floor, 1 cm: leaked / kept % | 2 cm | 5 cm | 10 cm | box, 1 cm: kept % | 2 cm | 5 cm | 10 "
          "cm "
          "|\n|---|---|---|---|---|---|---|---|---|---|\n");
      for (int i = 2; i < argc; ++i) contact_shadows(std::atoi(argv[i]));
      return 0;
    }
    if (std::strcmp(argv[1], "lit") == 0) {
      fmt::print(
          "| scene | texels | points | lit % | shadowed by itself % | lit by exact depths % "
          "|\n|---|---|---|---|---|---|\n");
      for (int i = 2; i < argc; ++i) lit(BenchScene(argv[i]));
      return 0;
    }
    const bool rows = std::strcmp(argv[1], "agreement") == 0;
    if (rows) {
      fmt::print(
          "| scene | texels | points | | agreement % | balanced % | wrongly lit % | wrongly dark % | always lit % "
          "| errors at edges, % of errors of % of pairs |\n|---|---|---|---|---|---|---|---|---|---|\n");
    }
    for (int i = 2; i < argc; ++i) rows ? agreement(BenchScene(argv[i])) : speed(BenchScene(argv[i]));
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
