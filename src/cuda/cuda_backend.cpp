#include "cuda/cuda_backend.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "backend/vpl_placement.h"
#include "backend/vpl_plan.h"
#include "cuda/film.h"
#include "cuda/light_by_maps.h"
#include "cuda/placement_kernels.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

void require_built(const ShadeOptions& options) {
  if (options.method == Method::lightcuts) {
    throw Error(Code::not_built,
                "the method lightcuts is not part of the CUDA backend yet; choose --backend cpu, or "
                "instant-radiosity or path");
  }
}

}  // namespace

/// A scene, its emitters and their copies on the device.
struct CudaBackend::Loaded {
  Loaded(Device& device, const Scene& loaded_scene)
      : scene(loaded_scene),
        arrays(loaded_scene),
        table(arrays),
        on_device(device, loaded_scene, arrays.view()),
        emitters(device, table.view(), arrays.view().instance_count) {}

  [[nodiscard]] TracedScene traced() const { return {on_device.view(), on_device.bvh(), emitters.view()}; }
  [[nodiscard]] EmitterPowers powers() const {
    const EmitterView& e = table.view();
    return {table.power(0, e.triangle_count), table.power(e.triangle_count, e.punctual_end()),
            table.power(e.punctual_end(), e.entry_count())};
  }

  /// Made when maps first need them.
  const DeviceEdges& edges(Device& device) {
    if (!hard_edges) hard_edges.emplace(device, arrays.view());
    return *hard_edges;
  }

  const Scene& scene;
  SceneArrays arrays;
  EmitterTable table;
  DeviceScene on_device;
  DeviceEmitters emitters;
  std::optional<DeviceEdges> hard_edges;
};

CudaBackend::CudaBackend(int index, std::uint64_t memory_limit) : device_(index, memory_limit) {}

std::string CudaBackend::device_name() const { return "cuda: " + device_.name(); }

void CudaBackend::set_scene(const Scene& scene, const ProgressFn& progress) {
  loaded_.reset();
  device_lights_ = {};
  lights_ = {};
  trees_ = {};
  if (progress && !progress("bvh", 0)) return;
  loaded_ = std::make_unique<Loaded>(device_, scene);
  if (progress) progress("bvh", 1);
}

CudaBackend::Loaded& CudaBackend::loaded() {
  if (loaded_ == nullptr) throw Error(Code::invalid_argument, "the backend has no scene yet; call set_scene first");
  return *loaded_;
}

void CudaBackend::trace_vpls(const VplOptions& options, const ProgressFn& progress) {
  Loaded& scene = loaded();
  if (!(scene.table.total_power() > 0)) {
    throw Error(Code::no_emitter, "nothing in the scene emits light: add a light or an environment");
  }
  if (progress && !progress("vpls", 0)) return;
  check_vpl_options(options);
  const bool for_camera = options.placement == VplPlacement::camera;
  VplOptions traced_options = options;
  traced_options.placement = VplPlacement::power;
  if (for_camera) traced_options.count = placement_candidates(options.count);
  device_lights_ = cuda::trace_vpls(device_, scene.traced(), scene.powers(), scene.scene, traced_options);
  device_.synchronize();
  lights_fetched_ = false;
  trees_ = {};
  if (for_camera && device_lights_.vpl_count + device_lights_.sky_count > options.count) {
    Lights candidates = lights();
    const std::vector<float> worth = rate_for_camera(device_, scene.traced(), options, device_lights_);
    device_lights_ = {};
    keep_lights(choose_for_camera(worth, candidates, options), candidates);
    set_lights(std::move(candidates));
  }
  if (progress) progress("vpls", 1);
}

void CudaBackend::set_lights(Lights lights) {
  DeviceLights on_device;
  on_device.vpl_count = static_cast<std::uint32_t>(lights.vpls.size());
  on_device.point_count = static_cast<std::uint32_t>(lights.points.size());
  on_device.directional_count = static_cast<std::uint32_t>(lights.directionals.size());
  on_device.vpls = DeviceBuffer<Vpl>(device_, lights.vpls.size());
  on_device.points = DeviceBuffer<PointLight>(device_, lights.points.size());
  on_device.directionals = DeviceBuffer<DirectionalLight>(device_, lights.directionals.size());
  on_device.vpls.upload(lights.vpls.data(), lights.vpls.size());
  on_device.points.upload(lights.points.data(), lights.points.size());
  on_device.directionals.upload(lights.directionals.data(), lights.directionals.size());
  on_device.primary_count = lights.primary_count;
  on_device.sky_count = lights.sky_count;
  on_device.path_count = lights.path_count;
  device_.synchronize();
  device_lights_ = std::move(on_device);
  lights_ = std::move(lights);
  lights_fetched_ = true;
  trees_ = {};
}

const Lights& CudaBackend::lights() {
  if (lights_fetched_) return lights_;
  const DeviceLights& d = device_lights_;
  lights_.vpls.resize(d.vpl_count);
  lights_.points.resize(d.point_count);
  lights_.directionals.resize(d.directional_count);
  d.vpls.download(lights_.vpls.data(), d.vpl_count);
  d.points.download(lights_.points.data(), d.point_count);
  d.directionals.download(lights_.directionals.data(), d.directional_count);
  lights_.primary_count = d.primary_count;
  lights_.sky_count = d.sky_count;
  lights_.path_count = d.path_count;
  lights_fetched_ = true;
  return lights_;
}

void CudaBackend::build_light_tree(const TreeOptions&, const ProgressFn&) {
  throw Error(Code::not_built, "light trees are not part of the CUDA backend yet; choose --backend cpu");
}

void CudaBackend::set_light_tree(LightTrees trees) { trees_ = std::move(trees); }

ShadeResult CudaBackend::shade(const Camera& camera, int width, int height, const ShadeOptions& options,
                               std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress) {
  Loaded& scene = loaded();
  require_built(options);
  const bool path = options.method == Method::path;
  const auto samples = static_cast<std::uint32_t>(options.samples > 0 ? options.samples : path ? 64 : 1);
  const PixelGrid grid = make_pixel_grid(camera, width, height, options.seed, samples == 1 && !path);
  const std::uint64_t needed = std::uint64_t{grid.slot_count()} * DeviceFilm::bytes_per_pixel();
  if (memory_bytes > 0 && needed > memory_bytes) {
    throw Error(Code::out_of_memory,
                fmt::format("a picture of {}x{} pixels needs {} MiB on the GPU, but the memory budget is {} MiB; make "
                            "the picture smaller or the budget larger",
                            width, height, needed >> 20, memory_bytes >> 20));
  }

  DeviceFilm film(device_, grid);
  const TracedScene traced = scene.traced();
  std::uint32_t done = 0, planes = 0;
  const auto go_on = [&] {
    device_.synchronize();
    return !progress || progress("shade", static_cast<double>(done) / samples);
  };
  bool running = go_on();
  if (path && running) {
    trace_pixels(device_, traced, grid, 0, film.pixels());
    add_sample(device_, grid, film.pixels(), nullptr, film.film());
    check(cudaMemsetAsync(film.film().radiance, 0, grid.slot_count() * sizeof(Vec3T<double>), device_.stream()),
          "clearing the film");
    planes = 1;
    const int reflections = std::clamp(options.bounces, 0, kMaxBounces) + 1;
    // A few samples a launch: a launch must end in time for a GPU that also drives a display.
    const std::uint32_t batch = std::max(1u, 4'000'000u / grid.slot_count());
    while (running && done < samples) {
      const std::uint32_t last = std::min(samples, done + batch);
      trace_paths(device_, traced, grid, done, last, reflections, film.film());
      done = last;
      running = go_on();
    }
  }
  const DeviceLights& d = device_lights_;
  const LightArrays lights{d.vpls.data(), d.points.data(), d.directionals.data(),
                           d.vpl_count,   d.point_count,   d.directional_count};
  const float min_distance = options.min_distance * scene.arrays.view().diagonal;
  std::optional<MapLighter> by_maps;
  if (!path && options.visibility == Visibility::ism) {
    const std::uint64_t left = device_.limit() - device_.used();
    const std::uint64_t budget = memory_bytes > 0 ? std::min(left, memory_bytes - needed) : left;
    by_maps.emplace(device_, traced.scene, scene.edges(device_), lights, options, budget);
  }
  double light = 0, lost = 0;
  while (!path && running && done < samples) {
    film.clear_sums();
    trace_pixels(device_, traced, grid, done, film.pixels());
    const SumView sums{film.light(), film.lost(), film.rays()};
    if (by_maps) {
      const auto part = [&](double share) { return !progress || progress("shade", (done + share) / samples); };
      if (!by_maps->light(grid, film.pixels(), min_distance, sums, part)) break;
    } else {
      sum_all_lights(device_, traced, grid, film.pixels(), lights, options.visibility == Visibility::rays, min_distance,
                     sums);
    }
    add_sample(device_, grid, film.pixels(), film.light(), film.film());
    const DeviceFilm::Totals totals = film.totals();
    light += totals.light;
    lost += totals.lost;
    statistics.rays += totals.rays;
    statistics.pairs += std::uint64_t{lights.vpl_count + lights.point_count + lights.directional_count} *
                        static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    planes = ++done;
    running = go_on();
  }
  if (by_maps) by_maps->report(statistics);
  statistics.clamped = lost > 0 ? lost / (light + lost) : 0;
  statistics.memory_bytes.device_peak = device_.peak();
  return {film.image(planes, done, samples), done == samples};
}

}  // namespace lightcuts::cuda

namespace lightcuts {

std::unique_ptr<Backend> make_cuda_backend(int device, std::uint64_t memory_limit) {
  return std::make_unique<cuda::CudaBackend>(device, memory_limit);
}

int cuda_device_count() noexcept {
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess ? count : 0;
}

}  // namespace lightcuts
