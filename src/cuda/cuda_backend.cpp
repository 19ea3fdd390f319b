#include "cuda/cuda_backend.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <utility>
#include <vector>

#include "backend/emitter_table.h"
#include "backend/find_occluders.h"
#include "backend/scene_arrays.h"
#include "backend/vpl_placement.h"
#include "backend/vpl_plan.h"
#include "cuda/film.h"
#include "cuda/packet_cut_by_maps.h"
#include "cuda/picture_groups.h"
#include "cuda/placement_kernels.h"
#include "kernels/cut_criterion.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

Lights download(const DeviceLights& d) {
  Lights lights;
  lights.vpls.resize(d.vpl_count);
  lights.points.resize(d.point_count);
  lights.directionals.resize(d.directional_count);
  d.vpls.download(lights.vpls.data(), d.vpl_count);
  d.points.download(lights.points.data(), d.point_count);
  d.directionals.download(lights.directionals.data(), d.directional_count);
  lights.primary_count = d.primary_count;
  lights.sky_count = d.sky_count;
  lights.path_count = d.path_count;
  return lights;
}

std::uint64_t less(std::uint64_t a, std::uint64_t b) { return a - std::min(a, b); }

/// What lighting by maps on demand needs beside points and maps: groups of pixels and lists of them, and heaps.
std::uint64_t working_bytes(const PixelGrid& grid, const ShadeOptions& options, std::uint64_t left) {
  const std::uint64_t lists = 24 * std::uint64_t{grid.slot_count()} + (1u << 20);
  return options.cut == CutWalk::heap ? lists + std::min<std::uint64_t>(left / 4, std::uint64_t{192} << 20) : lists;
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
        table(std::in_place, arrays),
        on_device(device, loaded_scene, arrays.view()),
        emitters(device, table->view(), arrays.view().instance_count) {
    place_occluders(device);
  }

  [[nodiscard]] TracedScene traced() const { return {on_device.view(), on_device.bvh(), emitters.view()}; }
  [[nodiscard]] EmitterPowers powers() const {
    const EmitterView& e = table->view();
    return {table->power(0, e.triangle_count), table->power(e.triangle_count, e.punctual_end()),
            table->power(e.punctual_end(), e.entry_count())};
  }

  /// Reads what emits and reflects again.
  void relight(Device& device) {
    arrays.update_materials();
    on_device.update_materials(arrays.view());
    table.emplace(arrays);
    emitters = DeviceEmitters(device, table->view(), arrays.view().instance_count);
  }

  void place_occluders(Device& device) {
    const std::vector<Occluder> found = find_occluders(arrays.view(), kMostOccluders);
    occluders = DeviceBuffer<Occluder>(device, found.size());
    occluders.upload(found.data(), found.size());
    occluder_count = static_cast<std::uint32_t>(found.size());
  }

  /// Made when maps first need them.
  const DeviceEdges& edges(Device& device) {
    if (!hard_edges) hard_edges.emplace(device, arrays.view());
    return *hard_edges;
  }

  /// Points that so many are drawn of for each map; kept until others are asked for.
  const DevicePoints& points(Device& device, std::uint32_t per_map, std::uint64_t seed, StageCounts& counts) {
    if (!has_points(per_map, seed)) {
      ++counts.points;
      surface_points.reset();
      surface_points.emplace(device, on_device.view(), edges(device), per_map, seed);
      points_per_map = per_map;
      points_seed = seed;
    }
    return *surface_points;
  }
  [[nodiscard]] bool has_points(std::uint32_t per_map, std::uint64_t seed) const {
    return surface_points && points_per_map == per_map && points_seed == seed;
  }

  const Scene& scene;
  SceneArrays arrays;
  std::optional<EmitterTable> table;
  DeviceScene on_device;
  DeviceEmitters emitters;
  DeviceBuffer<Occluder> occluders;
  std::uint32_t occluder_count = 0;
  std::optional<DeviceEdges> hard_edges;
  std::optional<DevicePoints> surface_points;
  std::uint32_t points_per_map = 0;
  std::uint64_t points_seed = 0;
};

CudaBackend::CudaBackend(int index, std::uint64_t memory_limit) : device_(index, memory_limit) {}

std::string CudaBackend::device_name() const { return "cuda: " + device_.name(); }

void CudaBackend::set_scene(const Scene& scene, const ProgressFn& progress) {
  drop_maps();
  loaded_.reset();
  device_lights_ = {};
  lights_ = {};
  drop_trees();
  if (progress && !progress("bvh", 0)) return;
  loaded_ = std::make_unique<Loaded>(device_, scene);
  ++counts_.scenes;
  if (progress) progress("bvh", 1);
}

void CudaBackend::scene_relit() {
  loaded().relight(device_);
  drop_trees();
}

CudaBackend::Loaded& CudaBackend::loaded() {
  if (loaded_ == nullptr) throw Error(Code::invalid_argument, "the backend has no scene yet; call set_scene first");
  return *loaded_;
}

/// Runs a stage; where there is too little memory beside maps of the last picture, again without them.
template <class Stage>
auto CudaBackend::beside_maps(Stage stage) {
  try {
    return stage();
  } catch (const Error& error) {
    if (error.code() != Code::out_of_memory || taken_by_maps() == 0) throw;
  }
  drop_maps();
  return stage();
}

void CudaBackend::trace_vpls(const VplOptions& options, const ProgressFn& progress) {
  Loaded& scene = loaded();
  if (!(scene.table->total_power() > 0)) {
    throw Error(Code::no_emitter, "nothing in the scene emits light: add a light or an environment");
  }
  if (progress && !progress("vpls", 0)) return;
  check_vpl_options(options);
  const bool for_camera = options.placement == VplPlacement::camera;
  VplOptions traced_options = options;
  traced_options.placement = VplPlacement::power;
  if (for_camera) traced_options.count = placement_candidates(options.count);
  StageTimer timer(device_, "vpls");
  DeviceLights traced = beside_maps(
      [&] { return cuda::trace_vpls(device_, scene.traced(), scene.powers(), scene.scene, traced_options); });
  if (for_camera && traced.vpl_count + traced.sky_count > options.count) {
    Lights candidates = download(traced);
    const std::vector<float> worth = rate_for_camera(device_, scene.traced(), options, traced);
    traced = {};
    keep_lights(choose_for_camera(worth, candidates, options), candidates);
    set_lights(std::move(candidates));
  } else {
    replace_lights(std::move(traced));
  }
  times_.vpls = timer.ms();
  ++counts_.vpls;
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
  replace_lights(std::move(on_device));
  lights_ = std::move(lights);
  lights_fetched_ = true;
}

/// Takes other lights; maps of those that have not moved stay.
void CudaBackend::replace_lights(DeviceLights lights) {
  drop_trees();
  all_by_maps_.reset();
  DeviceLights before = std::exchange(device_lights_, std::move(lights));
  lights_ = {};
  lights_fetched_ = false;
  const DeviceLights& now = device_lights_;
  if (light_maps_ && before.vpl_count == now.vpl_count && before.point_count == now.point_count &&
      before.directional_count == now.directional_count) {
    try {
      light_maps_->replace_lights(light_arrays());
    } catch (const Error& error) {
      if (error.code() != Code::out_of_memory) throw;
      light_maps_.reset();
    }
  } else {
    light_maps_.reset();
  }
}

const Lights& CudaBackend::lights() {
  if (!lights_fetched_) lights_ = download(device_lights_);
  lights_fetched_ = true;
  return lights_;
}

LightCounts CudaBackend::light_counts() const {
  const DeviceLights& d = device_lights_;
  return {d.vpl_count, d.point_count, d.directional_count, d.primary_count, d.sky_count, d.path_count};
}

void CudaBackend::drop_maps() {
  light_maps_.reset();
  all_by_maps_.reset();
}

void CudaBackend::forget_maps() {
  drop_maps();
  if (loaded_ != nullptr) loaded_->surface_points.reset();
}

std::uint64_t CudaBackend::taken_by_maps() const {
  return (light_maps_ ? light_maps_->taken_bytes() : 0) + (all_by_maps_ ? all_by_maps_->taken_bytes() : 0);
}
std::uint64_t CudaBackend::maps_made() const {
  return (light_maps_ ? light_maps_->made() : 0) + (all_by_maps_ ? all_by_maps_->made() : 0);
}
double CudaBackend::map_making_ms() const {
  return (light_maps_ ? light_maps_->making_ms() : 0) + (all_by_maps_ ? all_by_maps_->making_ms() : 0);
}

/// Sees to it that there are surface points and room for maps: those of the last picture, where they still serve.
///
/// @param budget  bytes for points and maps, what there is of both included
void CudaBackend::prepare_maps(const ShadeOptions& options, std::uint64_t budget) {
  Loaded& scene = loaded();
  const bool on_demand = options.method == Method::lightcuts;
  const MapOptions maps = map_options(options);
  const auto per_map = static_cast<std::uint32_t>(options.ism_points);
  const std::uint64_t for_points = DevicePoints::bytes_for(per_map, scene.edges(device_).triangle_count());
  const std::uint64_t for_maps = less(budget, for_points);
  const bool serves = scene.has_points(per_map, options.seed) &&
                      (on_demand ? light_maps_ && light_maps_->options() == maps && light_maps_->set_budget(for_maps)
                                 : all_by_maps_ && all_by_maps_->options() == maps &&
                                       all_by_maps_->taken_bytes() + kSumByMapsBytes <= for_maps);
  if (serves) return;
  drop_maps();
  const LightArrays lights = light_arrays();
  plan_maps_at_once(budget, for_points + LightMaps::fixed_bytes(device_, maps, lights), DeviceMaps::bytes_per_map(maps),
                    2, options.ism_size);
  StageTimer timer(device_, "surface points");
  const DevicePoints& points = scene.points(device_, per_map, options.seed, counts_);
  if (on_demand) {
    light_maps_.emplace(device_, points, maps, lights, for_maps);
  } else {
    all_by_maps_.emplace(device_, points, lights, maps, for_maps);
  }
  times_.points = timer.ms();
  times_.shadow_maps = times_.points;
}

void CudaBackend::drop_trees() {
  if (light_maps_) light_maps_->trees_changed();
  device_trees_ = {};
  trees_ = {};
  trees_fetched_ = true;
}

void CudaBackend::build_light_tree(const TreeOptions& options, const ProgressFn& progress) {
  const float diagonal = loaded().arrays.view().diagonal;
  drop_trees();
  if (progress && !progress("tree", 0)) return;
  StageTimer timer(device_, "light tree");
  if (options.builder == TreeBuilder::ploc) {
    device_trees_ = beside_maps([&] { return build_light_trees(device_, device_lights_, diagonal, options); });
  } else {
    trees_ = build_trees_by_cpu(lights(), diagonal, options, {});
    device_trees_ = beside_maps([&] { return upload_light_trees(device_, trees_, device_lights_); });
  }
  times_.tree = timer.ms();
  ++counts_.trees;
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

TreeCounts CudaBackend::tree_counts() const {
  TreeCounts counts;
  for (const DeviceTree& tree : device_trees_.kind) {
    counts.nodes += tree.node_count();
    counts.depth = std::max<std::uint64_t>(counts.depth, tree.depth);
  }
  return counts;
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
  std::uint64_t map_rounds = 0;

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
  CutJob job{device_trees_.view(), light_arrays(), s.min_distance, error, s.options.max_cut};
  if (s.options.visibility != Visibility::none) {
    const Loaded& scene = loaded();
    job.work = rays ? kWorkByRays : most_maps(job.lights) <= kFewLights ? kWorkByFewMaps : kWorkByMaps;
    job.occluders = scene.occluders.data();
    job.occluder_count = scene.occluder_count;
    job.scene_bounds = scene.arrays.view().bounds;
  }
  const SumView sums{s.film.light(), s.film.lost(), s.film.rays()};
  const bool complete =
      s.options.cut == CutWalk::heap ? light_heaps(s, job, sums, cuts) : light_groups(s, job, sums, cuts);
  if (complete) s.film.add_cuts();
  return complete;
}

/// Looks lights up from the pixels of a unit's tile.
LookUpUnit CudaBackend::look_up_by(Shading& s, const CutJob& job, std::uint32_t units_of_tile) {
  return [this, &s, &job, units_of_tile](std::uint32_t unit, int kind, const std::uint32_t* ids, std::uint32_t count,
                                         std::uint8_t* shares) {
    look_up_tile(device_, light_maps_->view(), s.film.pixels(), job.lights, unit / units_of_tile, kind, ids, count,
                 shares);
  };
}

bool CudaBackend::light_heaps(Shading& s, const CutJob& job, const SumView& sums, const CutView& cuts) {
  const auto go_on = [&](double part) { return s.go_on(device_, part); };
  const PixelView pixels = s.film.pixels();
  HeapVisibility visibility;
  if (!light_maps_) {
    if (s.options.visibility == Visibility::rays) visibility.sight = HeapSight::rays;
    return cut_by_heaps(device_, s.traced, pixels, job, visibility, {nullptr, s.grid.slot_count()}, heap_batch_, sums,
                        cuts, go_on);
  }
  visibility.sight = HeapSight::maps;
  const auto light = [&](const UnitList& list, const MissedList& missed) {
    visibility.maps = light_maps_->view();
    visibility.wanted = light_maps_->wanted();
    visibility.table = light_maps_->table();
    visibility.missed = missed;
    return cut_by_heaps(device_, s.traced, pixels, job, visibility, {list.units, list.count}, heap_batch_, sums, cuts,
                        [&](double) { return s.go_on(device_); });
  };
  return light_in_rounds(device_, *light_maps_, job.trees, {nullptr, s.grid.slot_count()}, kTilePixels,
                         {light, look_up_by(s, job, kTilePixels)}, go_on, s.map_rounds);
}

bool CudaBackend::light_groups(Shading& s, const CutJob& pixel_job, const SumView& sums, const CutView& view) {
  const PictureGroups groups(device_, s.film.pixels(), s.grid.tile_count);
  CutJob job = pixel_job;
  job.groups = groups.pixels();
  const GroupList list = groups.list();
  CutView cuts = view;
  group_order_.begin(device_, s.grid.tile_count);
  cuts.cost = group_order_.cost();
  const bool rays = s.options.visibility == Visibility::rays;
  // About a tenth of a second a launch on a slow GPU.
  const std::uint64_t pixels = (rays ? 100'000'000u : light_maps_ ? 1'000'000'000u : 2'000'000'000u) / kPlannedCut;
  const auto batch = static_cast<std::uint32_t>(pixels / kTilePixels);
  const auto go_on = [&](double part) { return s.go_on(device_, part); };
  if (light_maps_) {
    DeviceBuffer<LitBy> lit_by(device_, std::size_t{s.grid.tile_count} * kTileGroups);
    lit_by.fill_bytes(0);
    cuts.lit_by = lit_by.data();
    const auto in_batches = [&](const UnitList& units, const auto& work) {
      for (std::uint32_t first = 0; first < units.count; first += batch) {
        const std::uint32_t count = std::min(batch, units.count - first);
        work(group_order_.sorted(device_, {units.units + first, count}));
        if (first + count < units.count && !s.go_on(device_)) return false;
      }
      return true;
    };
    const auto light = [&](const UnitList& units, const MissedList& missed) {
      const bool complete = in_batches(units, [&](GroupList some) {
        some.missed = missed;
        cut_by_packets(device_, light_maps_->view(), light_maps_->wanted(), light_maps_->table(), s.film.pixels(), job,
                       some, sums, cuts);
      });
      group_order_.use_this_picture();
      return complete;
    };
    CutJob ask_job = job;
    ask_job.work = kWorkToAsk;
    const auto ask = [&](const UnitList& units) {
      const bool complete = in_batches(units, [&](const GroupList& some) {
        ask_for_maps(device_, light_maps_->view(), light_maps_->wanted(), s.film.pixels(), ask_job, some, cuts);
      });
      group_order_.use_this_picture();
      return complete;
    };
    const bool complete = light_in_rounds(device_, *light_maps_, job.trees, {list.groups, list.count}, kTileGroups,
                                          {light, look_up_by(s, job, kTileGroups), ask}, go_on, s.map_rounds);
    group_order_.end();
    return complete;
  }
  for (std::uint32_t first = 0; first < list.count; first += batch) {
    const std::uint32_t last = std::min(list.count, first + batch);
    const GroupList some = group_order_.sorted(device_, {list.groups + first, last - first});
    cut_by_packets(device_, s.traced, s.film.pixels(), job, rays, some, sums, cuts);
    if (last < list.count && !go_on(static_cast<double>(last) / list.count)) return false;
  }
  group_order_.end();
  return true;
}

bool CudaBackend::light_sample(Shading& s) {
  if (s.options.method == Method::lightcuts) return light_by_cuts(s);
  const LightArrays lights = light_arrays();
  const SumView sums{s.film.light(), s.film.lost(), s.film.rays()};
  if (all_by_maps_) {
    const auto part = [&](double share) { return !s.progress || s.progress("shade", (s.done + share) / s.samples); };
    if (!all_by_maps_->light(s.grid, s.film.pixels(), s.min_distance, sums, part)) return false;
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
  times_.pixels = times_.light = times_.shade = 0;
  const bool path = options.method == Method::path, cuts = options.method == Method::lightcuts;
  const bool by_maps = !path && options.visibility == Visibility::ism;
  if (cuts) require_trees();
  const auto samples = static_cast<std::uint32_t>(options.samples > 0 ? options.samples : path ? 64 : 1);
  const PixelGrid grid = make_pixel_grid(camera, width, height, options.seed, samples == 1 && !path);
  const std::uint64_t needed = std::uint64_t{grid.slot_count()} * DeviceFilm::bytes_per_pixel(cuts);
  if (memory_bytes > 0 && needed > memory_bytes) {
    throw Error(Code::out_of_memory,
                fmt::format("a picture of {}x{} pixels needs {} MiB on the GPU, but the memory budget is {} MiB; make "
                            "the picture smaller (--size) or the budget larger (--memory)",
                            width, height, (needed >> 20) + 1, memory_bytes >> 20));
  }
  // Maps are kept for the next picture only where they are of use and leave room for this one.
  if (!by_maps || needed > device_.limit() - device_.used()) drop_maps();
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
  times_.shadow_maps = times_.points = 0;
  if (by_maps) {
    const std::uint64_t held = taken_by_maps() + (scene.surface_points ? scene.surface_points->bytes() : 0);
    const std::uint64_t free = device_.limit() - device_.used() + held;
    const std::uint64_t left = memory_bytes > 0 ? std::min(free, memory_bytes - needed) : free;
    prepare_maps(options, less(left, cuts ? working_bytes(grid, options, left) : 0));
  }
  const std::uint64_t made_before = maps_made();
  const double ms_before = map_making_ms();
  ++counts_.pictures;
  bool complete = false;
  try {
    complete = shading.go_on(device_) && (path ? shade_paths(shading) : shade_lights(shading));
  } catch (...) {
    drop_maps();  // some may be half made
    throw;
  }

  const PictureTotals& totals = shading.totals;
  statistics.rays += totals.rays;
  statistics.clamped = totals.lost > 0 ? totals.lost / (totals.light + totals.lost) : 0;
  if (by_maps) {
    times_.shadow_maps += map_making_ms() - ms_before;
    statistics.time_ms.shadow_maps = times_.shadow_maps;
    if (all_by_maps_) all_by_maps_->report(statistics);
    const std::uint64_t made = maps_made() - made_before;
    counts_.maps += made;
    if (light_maps_) {
      light_maps_->report(statistics);
      statistics.shadow_maps.count = made;
      statistics.shadow_maps.rounds = shading.map_rounds;
    }
  }
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
