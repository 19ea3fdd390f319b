// What maps cost.

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "cpu/simd/isa.h"
#include "measurements.h"
#include "oracle/shadow_map_agreement.h"

namespace lightcuts {
namespace {

/// Processor time of this thread [s]: other programs on the machine do not count.
double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

/// Seconds that a shadow ray between random points of the scene takes, and that a map takes; the best of several rounds,
/// on one thread.
void measure_speed(const BenchScene& bench) {
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
void measure_scaling(const BenchScene& bench) {
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

}  // namespace lightcuts
