#include "cuda/cuda_backend.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <vector>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "backend/vpl_placement.h"
#include "backend/vpl_plan.h"
#include "cuda/film.h"
#include "cuda/light_by_maps.h"
#include "cuda/packet_cut.h"
#include "cuda/placement_kernels.h"
#include "kernels/cut_criterion.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

void require_built(const ShadeOptions& options) {
  if (options.method == Method::lightcuts && options.visibility == Visibility::ism) {
    throw Error(
        Code::not_built,
        "cuts with imperfect shadow maps are not part of the CUDA backend yet; choose --backend cpu, --visibility "
        "rays or none, or --method instant-radiosity");
  }
}

/// Cut nodes of a pixel that a launch is planned for; it does not bound them.
constexpr std::uint64_t kPlannedCut = 400;

/// What the picture's cuts tell.
void report_cuts(const DeviceBuffer<std::uint32_t>* used, const DeviceBuffer<CutCounts>& counted,
                 const PictureTotals& totals, Statistics& statistics) {
  const double cuts = static_cast<double>(std::max<std::uint64_t>(totals.cuts, 1));
  statistics.cut.mean = static_cast<double>(totals.cut_nodes) / cuts;
  statistics.cut.max = totals.largest_cut;
  statistics.cut.at_limit = static_cast<double>(totals.cuts_at_limit) / cuts;
  statistics.cut.lights_used = 0;
  for (int kind = 0; kind < kKinds; ++kind) {
    std::vector<std::uint32_t> words(used[kind].size());
    used[kind].download(words.data(), words.size());
    for (const std::uint32_t word : words) statistics.cut.lights_used += std::popcount(word);
  }
  CutCounts counts{};
  counted.download(&counts, 1);
  statistics.pairs += counts.pairs;
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
  drop_trees();
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
  StageTimer timer(device_, "vpls");
  device_lights_ = cuda::trace_vpls(device_, scene.traced(), scene.powers(), scene.scene, traced_options);
  lights_fetched_ = false;
  drop_trees();
  if (for_camera && device_lights_.vpl_count + device_lights_.sky_count > options.count) {
    Lights candidates = lights();
    const std::vector<float> worth = rate_for_camera(device_, scene.traced(), options, device_lights_);
    device_lights_ = {};
    keep_lights(choose_for_camera(worth, candidates, options), candidates);
    set_lights(std::move(candidates));
  }
  times_.vpls = timer.ms();
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
  drop_trees();
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

void CudaBackend::drop_trees() {
  device_trees_ = {};
  trees_ = {};
  trees_fetched_ = true;
}

void CudaBackend::build_light_tree(const TreeOptions& options, const ProgressFn& progress) {
  const float diagonal = loaded().arrays.view().diagonal;
  drop_trees();
  if (progress && !progress("tree", 0)) return;
  StageTimer timer(device_, "light tree");
  device_trees_ = build_light_trees(device_, device_lights_, diagonal, options);
  times_.tree = timer.ms();
  trees_fetched_ = false;
  if (progress) progress("tree", 1);
}

void CudaBackend::set_light_tree(LightTrees trees) {
  drop_trees();
  device_trees_ = upload_light_trees(device_, trees, device_lights_);
  trees_ = std::move(trees);
}

const LightTrees& CudaBackend::light_trees() {
  if (!trees_fetched_) trees_ = download_light_trees(device_trees_);
  trees_fetched_ = true;
  return trees_;
}

void CudaBackend::require_trees() const {
  const DeviceLights& d = device_lights_;
  const DeviceTree* const trees = device_trees_.kind.data();
  if (trees[vpl_kind].leaf_count == d.vpl_count && trees[point_kind].leaf_count == d.point_count &&
      trees[directional_kind].leaf_count == d.directional_count) {
    return;
  }
  throw Error(Code::invalid_argument, "the light trees are not those of the lights; call build_light_tree first");
}

LightArrays CudaBackend::light_arrays() const {
  const DeviceLights& d = device_lights_;
  return {d.vpls.data(), d.points.data(), d.directionals.data(), d.vpl_count, d.point_count, d.directional_count};
}

/// One picture while it is made.
struct CudaBackend::Shading {
  const ShadeOptions& options;
  Statistics& statistics;
  const ProgressFn& progress;
  TracedScene traced;
  PixelGrid grid;
  float min_distance;
  std::uint32_t samples;
  DeviceFilm film;
  std::uint32_t done = 0, planes = 0;
  PictureTotals totals{};
  DeviceBuffer<std::uint32_t> used[kKinds] = {};  ///< a bit a light in some cut
  DeviceBuffer<CutCounts> cut_counts = {};
  std::optional<MapLighter> by_maps = {};

  /// Waits for the device; false where progress says stop. `part` of the sample under way is done.
  [[nodiscard]] bool go_on(Device& device, double part = 0) const {
    device.synchronize();
    return !progress || progress("shade", (done + part) / samples);
  }
};

bool CudaBackend::shade_paths(Shading& s) {
  trace_pixels(device_, s.traced, s.grid, 0, s.film.pixels());
  add_sample(device_, s.grid, s.film.pixels(), nullptr, s.film.film());
  check(cudaMemsetAsync(s.film.film().radiance, 0, s.grid.slot_count() * sizeof(Vec3T<double>), device_.stream()),
        "clearing the film");
  s.planes = 1;
  const int reflections = std::clamp(s.options.bounces, 0, kMaxBounces) + 1;
  // A few samples a launch: a launch must end in time for a GPU that also drives a display.
  const std::uint32_t batch = std::max(1u, 4'000'000u / s.grid.slot_count());
  while (s.done < s.samples) {
    const std::uint32_t last = std::min(s.samples, s.done + batch);
    trace_paths(device_, s.traced, s.grid, s.done, last, reflections, s.film.film());
    s.done = last;
    if (!s.go_on(device_)) return false;
  }
  return true;
}

/// Lights the sample by cuts; false where it was stopped.
bool CudaBackend::light_by_cuts(Shading& s) {
  CutView cuts{s.film.cut_size(), s.film.cut_bound(), s.film.cut_at_limit(), s.cut_counts.data(), {}};
  for (int kind = 0; kind < kKinds; ++kind) cuts.used[kind] = s.used[kind].data();
  const bool rays = s.options.visibility == Visibility::rays;
  const float error = rays ? kShadowedShare * s.options.error : s.options.error;
  const CutJob job{device_trees_.view(), light_arrays(), s.min_distance, error, s.options.max_cut};
  const SumView sums{s.film.light(), s.film.lost(), s.film.rays()};
  if (s.options.cut == CutWalk::heap) {
    const bool complete = cut_by_heaps(device_, s.traced, s.grid, s.film.pixels(), job, rays, heap_batch_, sums, cuts,
                                       [&](double part) { return s.go_on(device_, part); });
    if (complete) s.film.add_cuts();
    return complete;
  }
  // About a tenth of a second a launch on a slow GPU.
  const std::uint64_t pixels = (rays ? 100'000'000u : 2'000'000'000u) / kPlannedCut;
  const auto batch = static_cast<std::uint32_t>(pixels / kTilePixels);
  for (std::uint32_t first = 0; first < s.grid.tile_count; first += batch) {
    const std::uint32_t last = std::min(s.grid.tile_count, first + batch);
    cut_by_packets(device_, s.traced, s.film.pixels(), job, rays, first, last, sums, cuts);
    if (last < s.grid.tile_count && !s.go_on(device_, static_cast<double>(last) / s.grid.tile_count)) return false;
  }
  s.film.add_cuts();
  return true;
}

bool CudaBackend::light_sample(Shading& s) {
  if (s.options.method == Method::lightcuts) return light_by_cuts(s);
  const LightArrays lights = light_arrays();
  const SumView sums{s.film.light(), s.film.lost(), s.film.rays()};
  if (s.by_maps) {
    const auto part = [&](double share) { return !s.progress || s.progress("shade", (s.done + share) / s.samples); };
    if (!s.by_maps->light(s.grid, s.film.pixels(), s.min_distance, sums, part)) return false;
  } else {
    sum_all_lights(device_, s.traced, s.grid, s.film.pixels(), lights, s.options.visibility == Visibility::rays,
                   s.min_distance, sums);
  }
  s.statistics.pairs += std::uint64_t{lights.vpl_count + lights.point_count + lights.directional_count} *
                        static_cast<std::uint64_t>(s.grid.width) * static_cast<std::uint64_t>(s.grid.height);
  return true;
}

bool CudaBackend::shade_lights(Shading& s) {
  while (s.done < s.samples) {
    StageTimer whole(device_, "shade"), pixels(device_, "camera rays");
    s.film.clear_sums();
    trace_pixels(device_, s.traced, s.grid, s.done, s.film.pixels());
    pixels.stop();
    StageTimer light(device_, "light");
    if (!light_sample(s)) return false;
    light.stop();
    add_sample(device_, s.grid, s.film.pixels(), s.film.light(), s.film.film());
    whole.stop();
    times_.pixels += pixels.ms();
    times_.light += light.ms();
    times_.shade += whole.ms();
    const PictureTotals totals = s.film.totals();
    s.totals.light += totals.light;
    s.totals.lost += totals.lost;
    s.totals.rays += totals.rays;
    s.totals.cuts += totals.cuts;
    s.totals.cut_nodes += totals.cut_nodes;
    s.totals.largest_cut = std::max(s.totals.largest_cut, totals.largest_cut);
    s.totals.cuts_at_limit += totals.cuts_at_limit;
    s.planes = ++s.done;
    if (!s.go_on(device_)) return false;
  }
  return true;
}

ShadeResult CudaBackend::shade(const Camera& camera, int width, int height, const ShadeOptions& options,
                               std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress) {
  Loaded& scene = loaded();
  require_built(options);
  times_.pixels = times_.light = times_.shade = 0;
  const bool path = options.method == Method::path, cuts = options.method == Method::lightcuts;
  if (cuts) require_trees();
  const auto samples = static_cast<std::uint32_t>(options.samples > 0 ? options.samples : path ? 64 : 1);
  const PixelGrid grid = make_pixel_grid(camera, width, height, options.seed, samples == 1 && !path);
  const std::uint64_t needed = std::uint64_t{grid.slot_count()} * DeviceFilm::bytes_per_pixel(cuts);
  if (memory_bytes > 0 && needed > memory_bytes) {
    throw Error(Code::out_of_memory,
                fmt::format("a picture of {}x{} pixels needs {} MiB on the GPU, but the memory budget is {} MiB; make "
                            "the picture smaller or the budget larger",
                            width, height, needed >> 20, memory_bytes >> 20));
  }
  Shading shading{options,  statistics,
                  progress, scene.traced(),
                  grid,     options.min_distance * scene.arrays.view().diagonal,
                  samples,  DeviceFilm(device_, grid, cuts)};
  if (cuts) {
    for (int kind = 0; kind < kKinds; ++kind) {
      shading.used[kind] = DeviceBuffer<std::uint32_t>(device_, (device_trees_.kind[kind].leaf_count + 31) / 32);
      shading.used[kind].fill_bytes(0);
    }
    shading.cut_counts = DeviceBuffer<CutCounts>(device_, 1);
    shading.cut_counts.fill_bytes(0);
  }
  if (!path && options.visibility == Visibility::ism) {
    const std::uint64_t left = device_.limit() - device_.used();
    const std::uint64_t budget = memory_bytes > 0 ? std::min(left, memory_bytes - needed) : left;
    shading.by_maps.emplace(device_, shading.traced.scene, scene.edges(device_), light_arrays(), options, budget);
  }
  const bool complete = shading.go_on(device_) && (path ? shade_paths(shading) : shade_lights(shading));

  const PictureTotals& totals = shading.totals;
  statistics.rays += totals.rays;
  statistics.clamped = totals.lost > 0 ? totals.lost / (totals.light + totals.lost) : 0;
  if (shading.by_maps) shading.by_maps->report(statistics);
  if (cuts) report_cuts(shading.used, shading.cut_counts, totals, statistics);
  statistics.memory_bytes.device_peak = device_.peak();
  return {shading.film.image(shading.planes, shading.done, samples), complete && shading.done == samples};
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
