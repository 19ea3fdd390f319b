// How often maps say what rays say.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "cpu/simd/isa.h"
#include "measurements.h"
#include "oracle/lit_surfaces.h"
#include "oracle/shadow_map_agreement.h"
#include "pictures.h"

namespace lightcuts {
namespace {

void print_agreement(const BenchScene& bench, std::uint32_t points, const ShadowMapOptions& options, std::size_t step,
                     const char* note, bool exact = false) {
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

/// The other ways of making maps, at their usual size and number of points.
template <class Measure>
void for_each_variant(const Measure& measure) {
  ShadowMapOptions options;
  options.levels = 0;
  measure(options, "holes stay");
  options.levels = 2;
  options.fill = HoleFill::mean;
  measure(options, "study's mean, 2 levels");
  options = {};
  options.depth_bits = 32;
  measure(options, "32 bits");
  options = {};
  options.choice = PointChoice::noise;
  measure(options, "study's noise");
}
constexpr std::uint32_t kUsualPoints = PointOptions{}.per_map;

}  // namespace

void print_agreement_heading() {
  fmt::print(
      "| scene | texels | points | | agreement % | balanced % | wrongly lit % | wrongly dark % | always lit % "
      "| errors at edges, % of errors of % of pairs |\n|---|---|---|---|---|---|---|---|---|---|\n");
}

/// With 2000 VPLs every row compares at least 14 000 pairs.
void measure_agreement(const BenchScene& bench, const Sweep& sweep) {
  for (const int size : sweep.texels) {
    ShadowMapOptions options;
    options.size = size;
    for (const std::uint32_t points : sweep.points) {
      print_agreement(bench, points, options, sweep.step, "edges, 2 levels");
    }
    print_agreement(bench, kUsualPoints, options, sweep.step, "exact depths", true);
  }
  for_each_variant([&](const ShadowMapOptions& options, const char* note) {
    print_agreement(bench, kUsualPoints, options, sweep.step, note);
  });
}

void print_lit_heading() {
  fmt::print(
      "| scene | texels | points | lit % (exact depths) | in corners, % of places | lit % there (exact depths) | "
      "places "
      "|\n|---|---|---|---|---|---|---|\n");
}

void measure_lit(const BenchScene& bench, const Sweep& sweep) {
  for (const int size : sweep.texels) {
    for (const std::uint32_t points : sweep.points) {
      const SurfacePoints surface(bench.cpu_scene->view(), {points});
      ShadowMapOptions options;
      options.size = size;
      ShadowMapSet maps(ism_kernels(selected_isa()), surface, bench.lights, options);
      maps.add(every_light(bench.lights, 0, sweep.step));
      const oracle::LitSurfaces l =
          oracle::measure_lit_surfaces(maps, bench.lights, *bench.cpu_scene, *bench.tracer, sweep.step, 60);
      const double places = l.clear.asked + l.corners.asked;
      fmt::print("| {} | {} | {} | {:.2f} ({:.2f}) | {:.1f} | {:.2f} ({:.2f}) | {:.0f} |\n", bench.name, size, points,
                 100 * l.clear.lit_share(), 100 * l.clear.exact_share(), 100 * l.corners.asked / places,
                 100 * l.corners.lit_share(), 100 * l.corners.exact_share(), places);
      std::fflush(stdout);
    }
  }
}

void print_pictures_heading() { fmt::print("| scene | texels | points | | relmse / FLIP |\n|---|---|---|---|---|\n"); }

void compare_pictures(const BenchScene& bench, const Sweep& sweep) {
  const Pictures pictures(bench);
  const auto row = [&](const ShadowMapOptions& options, std::uint32_t per_map, const char* note) {
    const SurfacePoints points(bench.cpu_scene->view(), {per_map});
    ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
    maps.add(every_light(bench.lights));
    const Comparison c = pictures.compare_to_rays(ShadowMapVisibility(maps));
    fmt::print("| {} | {} | {} | {} | {:.3g} / {:.3f} |\n", bench.name, options.size, per_map, note, c.relmse, c.flip);
    std::fflush(stdout);
  };
  for (const int size : sweep.texels) {
    ShadowMapOptions options;
    options.size = size;
    for (const std::uint32_t points : sweep.points) row(options, points, "edges, 2 levels");
  }
  for_each_variant([&](const ShadowMapOptions& options, const char* note) { row(options, kUsualPoints, note); });
}

}  // namespace lightcuts
