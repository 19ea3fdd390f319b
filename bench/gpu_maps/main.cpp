// Stages on a GPU: what light trees, points, maps, lookups and the study's pull-push cost, in device time, the median of 20
// runs after 3 to warm up. Usage: bench_gpu_maps [tree|points|maps|sum|atlas|all] SCENE...   (a built-in scene, or a file)

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "cuda/device_emitters.h"
#include "cuda/device_scene.h"
#include "cuda/fill_atlas.h"
#include "cuda/film.h"
#include "cuda/light_by_maps.h"
#include "cuda/light_tree.h"
#include "cuda/vpl_kernels.h"
#include "lightcuts/io.h"

namespace lightcuts::cuda {
namespace {

/// Median time of what `work` puts on the stream [ms]; `before` is not timed.
template <class Before, class Work>
double median_ms(Device& device, const Before& before, const Work& work) {
  cudaEvent_t start = nullptr, end = nullptr;
  check(cudaEventCreate(&start), "timing");
  check(cudaEventCreate(&end), "timing");
  std::vector<float> times;
  for (int run = 0; run < 23; ++run) {
    before();
    check(cudaEventRecord(start, device.stream()), "timing");
    work();
    check(cudaEventRecord(end, device.stream()), "timing");
    device.synchronize();
    float ms = 0;
    check(cudaEventElapsedTime(&ms, start, end), "timing");
    if (run >= 3) times.push_back(ms);
  }
  cudaEventDestroy(start);
  cudaEventDestroy(end);
  std::sort(times.begin(), times.end());
  return 0.5 * (times[9] + times[10]);
}

/// A scene on the device.
struct Bench {
  std::string name;
  Device& device;
  Scene scene;
  SceneArrays arrays;
  EmitterTable table;
  DeviceScene on_device;
  DeviceEmitters emitters;
  DeviceEdges edges;
  DeviceLights lights;

  static Scene load(const char* which) {
    Scene scene = std::strchr(which, '.') != nullptr ? load_scene(which).scene : make_builtin_scene(which);
    if (!emits_light(scene)) scene.environment = Environment{};
    validate(scene);
    return scene;
  }

  Bench(Device& d, const char* which)
      : name(which),
        device(d),
        scene(load(which)),
        arrays(scene),
        table(arrays),
        on_device(d, scene, arrays.view()),
        emitters(d, table.view(), arrays.view().instance_count),
        edges(d, arrays.view()) {
    if (name.find('/') != std::string::npos) name = name.substr(0, name.rfind('/'));
    name = name.substr(name.rfind('/') + 1);
  }

  [[nodiscard]] TracedScene traced() const { return {on_device.view(), on_device.bvh(), emitters.view()}; }

  LightArrays trace(std::uint64_t count) {
    const EmitterView& e = table.view();
    VplOptions options;
    options.count = count;
    lights = trace_vpls(device, traced(),
                        {table.power(0, e.triangle_count), table.power(e.triangle_count, e.punctual_end()),
                         table.power(e.punctual_end(), e.entry_count())},
                        scene, options);
    return {lights.vpls.data(), nullptr, nullptr, lights.vpl_count, 0, 0};
  }
};

void print_row(const Bench& bench, const std::string& what, double ms, const std::string& note) {
  fmt::print("| {} | {} | {:.3f} | {} |\n", bench.name, what, ms, note);
  std::fflush(stdout);
}

void time_tree(Bench& bench) {
  for (const std::uint64_t count : {64u, 2550u, 65536u, 1048576u}) {
    bench.trace(count);
    std::uint32_t depth = 0;
    const auto build = [&] {
      depth = build_light_trees(bench.device, bench.lights, bench.arrays.view().diagonal, {}).kind[vpl_kind].depth;
    };
    const double ms = median_ms(
        bench.device, [] {}, build);
    print_row(bench, fmt::format("light tree of {} VPLs", bench.lights.vpl_count), ms, fmt::format("depth {}", depth));
  }
}

void time_points(Bench& bench) {
  for (const std::uint32_t per_map : {2000u, 8000u}) {
    const double ms = median_ms(
        bench.device, [] {}, [&] { DevicePoints(bench.device, bench.on_device.view(), bench.edges, per_map, 1); });
    print_row(bench, fmt::format("points for maps of {}", per_map), ms,
              fmt::format("{} points", surface_point_count(per_map)));
  }
}

void time_maps(Bench& bench) {
  struct Row {
    std::uint64_t count;
    int size;
    std::uint32_t points;
    HoleFill fill;
    int levels;
  };
  for (const Row& row : {Row{65536, 32, 2000, HoleFill::edges, 2}, Row{65536, 32, 2000, HoleFill::mean, 2},
                         Row{65536, 32, 2000, HoleFill::edges, 0}, Row{8192, 64, 8000, HoleFill::edges, 2},
                         Row{2048, 128, 8000, HoleFill::edges, 2}, Row{16, 256, 64000, HoleFill::edges, 2}}) {
    const LightArrays lights = bench.trace(row.count);
    const DevicePoints points(bench.device, bench.on_device.view(), bench.edges, row.points, 1);
    for (const int threads : {64, 128, 256}) {
      if (threads == 64 && row.size > 64) continue;
      MapOptions options;
      options.size = row.size;
      options.fill = row.fill;
      options.levels = row.levels;
      options.threads = threads;
      DeviceMaps maps(bench.device, options, lights, lights.vpl_count);
      const double ms = median_ms(
          bench.device, [&] { maps.clear(); },
          [&] {
            maps.add_vpls(points.view(), {nullptr, 0, lights.vpl_count});
          });
      print_row(bench, fmt::format("{} maps of {}x{}, {} points", maps.count(), row.size, row.size, row.points), ms,
                fmt::format("{} threads a map, {} levels {}", threads, row.levels,
                            row.fill == HoleFill::edges ? "edges" : "mean"));
    }
  }
}

void time_sum(Bench& bench) {
  const LightArrays lights = bench.trace(2550);
  const int side = 1000;
  const PixelGrid grid = make_pixel_grid(select_camera(bench.scene, ""), side, side, 1, true);
  DeviceFilm film(bench.device, grid);
  trace_pixels(bench.device, bench.traced(), grid, 0, film.pixels());
  const float min_distance = 0.0133f * bench.arrays.view().diagonal;
  const DevicePoints points(bench.device, bench.on_device.view(), bench.edges, 2000, 1);
  MapOptions options;
  options.size = 32;
  DeviceMaps maps(bench.device, options, lights, lights.vpl_count);
  const auto make = [&] { maps.add_vpls(points.view(), {nullptr, 0, lights.vpl_count}); };
  const LightSpan span{0, lights.vpl_count, 0, 0, 0, 0};
  const SumView sums{film.light(), film.lost(), film.rays()};
  const auto sum = [&] {
    sum_lights_by_maps(bench.device, grid, film.pixels(), lights, span, maps.view(), min_distance, sums);
  };
  const std::string what = fmt::format("sum over {} VPLs, {}x{}", lights.vpl_count, side, side);
  make();
  print_row(bench, what,
            median_ms(
                bench.device, [&] { film.clear_sums(); }, sum),
            "maps of 32x32 made before");
  const double both = median_ms(
      bench.device,
      [&] {
        film.clear_sums();
        maps.clear();
      },
      [&] {
        make();
        sum();
      });
  print_row(bench, what, both, "maps of 32x32, 2000 points, made too");
  const double none = median_ms(
      bench.device, [&] { film.clear_sums(); },
      [&] { sum_all_lights(bench.device, bench.traced(), grid, film.pixels(), lights, false, min_distance, sums); });
  print_row(bench, what, none,
            fmt::format("unshadowed: {:.2f} T pairs/s", 1e-9 * lights.vpl_count * side * side / none));
}

void time_atlas(Device& device) {
  std::mt19937 dice(1);
  for (const int size : {1408, 2688, 3968, 16000}) {
    std::vector<std::uint16_t> codes(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
    // A third is drawn.
    for (std::uint16_t& code : codes) code = dice() % 3 == 0 ? static_cast<std::uint16_t>(dice() % 65000) : 0xffff;
    DeviceBuffer<std::uint16_t> fresh(device, codes.size()), atlas(device, codes.size());
    DeviceBuffer<std::uint16_t> scratch(device, atlas_scratch(size, 2));
    fresh.upload(codes.data(), codes.size());
    const auto copy = [&] {
      check(cudaMemcpyAsync(atlas.data(), fresh.data(), 2 * codes.size(), cudaMemcpyDeviceToDevice, device.stream()),
            "copying");
    };
    const double study =
        median_ms(device, copy, [&] { fill_atlas(device, atlas.data(), size, 2, HoleFill::mean, scratch.data()); });
    const double once = median_ms(device, copy, [&] { fill_atlas_at_once(device, atlas.data(), size); });
    const double floor = median_ms(
        device, [] {}, copy);
    fmt::print("| atlas {}x{} | study's way {:.4f} ms | at once {:.4f} ms | copied {:.4f} ms |\n", size, size, study,
               once, floor);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace lightcuts::cuda

int main(int argc, char** argv) {
  using namespace lightcuts::cuda;
  try {
    if (argc < 2) {
      std::fputs("usage: bench_gpu_maps tree|points|maps|sum|atlas|all SCENE...\n", stderr);
      return 2;
    }
    const std::string what = argv[1];
    Device device(0, 0);
    const auto wanted = [&](const char* name) { return what == name || what == "all"; };
    if (wanted("atlas")) time_atlas(device);
    for (int i = 2; i < argc; ++i) {
      Bench bench(device, argv[i]);
      if (wanted("tree")) time_tree(bench);
      if (wanted("points")) time_points(bench);
      if (wanted("sum")) time_sum(bench);
      if (wanted("maps")) time_maps(bench);
    }
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
