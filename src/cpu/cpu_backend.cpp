#include "cpu/cpu_backend.h"

#include <fmt/format.h>
#include <tbb/info.h>

#include <algorithm>
#include <utility>

#include "cpu/all_lights.h"
#include "cpu/cut/heap_lighter.h"
#include "cpu/cut/packet_lighter.h"
#include "cpu/ism/light_by_maps.h"
#include "cpu/path_tracer.h"
#include "cpu/progress.h"
#include "cpu/shade_picture.h"
#include "cpu/tree/build_light_trees.h"
#include "cpu/tree/redraw.h"
#include "cpu/visibility.h"
#include "cpu/vpl_tracer.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

void require_memory(std::uint64_t needed, std::uint64_t budget, int width, int height) {
  if (budget == 0 || needed <= budget) return;
  throw Error(Code::out_of_memory,
              fmt::format("a picture of {}x{} pixels needs {} MiB, but the memory budget is {} MiB; make the picture "
                          "smaller or the budget larger",
                          width, height, needed >> 20, budget >> 20));
}

/// More threads than processors would only wait for each other (and make TBB print a warning).
int usable_threads(int threads) {
  const int processors = tbb::info::default_concurrency();
  return threads == 0 ? processors : std::min(threads, processors);
}

/// The trees must be of the current lights: set_light_tree takes what it is given.
void require_trees(const LightTrees& trees, const LightSet& lights) {
  const auto fits = [](const LightTree& tree, std::size_t count) {
    return tree.nodes.size() == (count == 0 ? 0 : 2 * count - 1);
  };
  if (fits(trees.vpls, lights.vpls.size()) && fits(trees.points, lights.points.size()) &&
      fits(trees.directionals, lights.directionals.size())) {
    return;
  }
  throw Error(Code::invalid_argument, "the light trees are not those of the lights; call build_light_tree first");
}

std::uint32_t sample_count(const ShadeOptions& options) {
  if (options.samples > 0) return static_cast<std::uint32_t>(options.samples);
  return options.method == Method::path ? 64 : 1;
}

/// Rays go between any two points of scene and lights.
OccluderView view_of(const std::vector<Occluder>& occluders, const SceneView& scene, const LightTrees& trees) {
  Box box = scene.bounds;
  if (!trees.vpls.nodes.empty()) box = extend(box, trees.vpls.nodes[0].box);
  if (!trees.points.nodes.empty()) box = extend(box, trees.points.nodes[0].box);
  return occluder_view(occluders.data(), static_cast<std::uint32_t>(occluders.size()), box);
}

}  // namespace

CpuBackend::CpuBackend(int threads)
    : isa_(selected_isa()), kernels_(shade_kernels(isa_)), arena_(usable_threads(threads)) {
  arena_.initialize();
}

std::string CpuBackend::device_name() const {
  const int threads = arena_.max_concurrency();
  return fmt::format("cpu: {}, {} thread{}", isa_name(isa_), threads, threads == 1 ? "" : "s");
}

void CpuBackend::set_scene(const Scene& scene, const ProgressFn& progress) {
  kept_.forget();
  loaded_.reset();
  lights_ = {};
  light_set_ = {};
  last_lights_ = {};
  last_light_set_ = {};
  trees_ = {};
  if (progress && !progress("bvh", 0)) return;
  arena_.execute([&] { loaded_ = std::make_unique<Loaded>(scene); });
  ++counts_.scenes;
  if (progress) progress("bvh", 1);
}

void CpuBackend::scene_relit() {
  Loaded& scene = loaded();
  if (kept_.has_maps() && lights_.count() > 0) {
    last_light_set_ = std::exchange(light_set_, {});
    last_lights_ = std::move(lights_);  // the set's VPLs stay where they are
  }
  lights_ = {};
  light_set_ = {};
  trees_ = {};
  scene.cpu_scene.update_materials();
  arena_.execute([&] { scene.emitters.emplace(scene.cpu_scene); });
}

LightCounts CpuBackend::light_counts() const {
  return {lights_.vpls.size(),   lights_.points.size(), lights_.directionals.size(),
          lights_.primary_count, lights_.sky_count,     lights_.path_count};
}

TreeCounts CpuBackend::tree_counts() const {
  TreeCounts counts;
  for (const LightTree* tree : {&trees_.vpls, &trees_.points, &trees_.directionals}) {
    counts.nodes += tree->nodes.size();
    counts.depth = std::max<std::uint64_t>(counts.depth, tree->depth);
  }
  return counts;
}

CpuBackend::Loaded& CpuBackend::loaded() {
  if (loaded_ == nullptr) throw Error(Code::invalid_argument, "the backend has no scene yet; call set_scene first");
  return *loaded_;
}

void CpuBackend::trace_vpls(const VplOptions& options, const ProgressFn& progress) {
  Loaded& scene = loaded();
  Lights lights;
  arena_.execute(
      [&] { lights = lightcuts::trace_vpls(scene.cpu_scene, *scene.emitters, scene.tracer, options, progress); });
  ++counts_.vpls;
  set_lights(std::move(lights));
}

void CpuBackend::set_lights(Lights lights) {
  LightSet set = make_light_set(lights);
  kept_.lights_change(lights_.count() > 0 ? light_set_ : last_light_set_, set);
  last_light_set_ = {};
  last_lights_ = {};
  lights_ = std::move(lights);
  light_set_ = std::move(set);
  trees_ = {};
}

void CpuBackend::build_light_tree(const TreeOptions& options, const ProgressFn& progress) {
  const float diagonal = loaded().cpu_scene.view().diagonal;
  arena_.execute([&] { trees_ = build_light_trees(lights_, diagonal, options, progress); });
  drawn_with_ = options.seed;
  ++counts_.trees;
}

void CpuBackend::set_light_tree(LightTrees trees) {
  trees_ = std::move(trees);
  drawn_with_.reset();
}

ShadeResult CpuBackend::shade(const Camera& camera, int width, int height, const ShadeOptions& options,
                              std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress) {
  try {
    return shade_picture(camera, width, height, options, memory_bytes, statistics, progress);
  } catch (...) {
    kept_.forget();
    throw;
  }
}

ShadeResult CpuBackend::shade_picture(const Camera& camera, int width, int height, const ShadeOptions& options,
                                      std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& callback) {
  const Loaded& scene = loaded();
  const std::uint64_t film_bytes =
      static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * Film::bytes_per_pixel();
  require_memory(film_bytes, memory_bytes, width, height);

  const bool path = options.method == Method::path, cuts = options.method == Method::lightcuts;
  if (cuts) require_trees(trees_, light_set_);
  const std::uint32_t samples = sample_count(options);
  const View view = make_view(camera, width, height, samples, options.seed, samples == 1 && !path);
  Progress progress(callback, "shade", tile_count(view) * static_cast<double>(samples));
  const float min_distance = options.min_distance * scene.cpu_scene.view().diagonal;

  // What a tile does, from the method and the visibility chosen.
  const TileSource source{view, scene.cpu_scene.view(), scene.tracer, scene.emitters->view()};
  const RayVisibility rays(scene.tracer);
  LightMaps* maps = nullptr;
  const std::uint64_t left = memory_bytes == 0 ? 0 : std::max<std::uint64_t>(1, memory_bytes - film_bytes);
  const MapLighting by_maps{source, light_set_, kernels_, ism_kernels(isa_), options, min_distance,
                            left,   kept_,      counts_};
  if (path || options.visibility != Visibility::ism) {
    if (left != 0 && kept_.bytes() > left) kept_.forget();
  } else if (cuts) {
    arena_.execute([&] { maps = &maps_for_cuts(by_maps, arena_.max_concurrency(), statistics); });
  }
  const PacketVisibility* visibility = options.visibility == Visibility::rays ? &rays
                                       : maps != nullptr                      ? maps->visibility()
                                                                              : nullptr;
  const AllLights all_lights(kernels_, light_set_, visibility, min_distance);
  LightMarks marks(trees_);
  const float error = options.visibility == Visibility::rays ? kShadowedShare * options.error : options.error;
  // Maps let some light through where rays do not: what is hidden for certain is left out with them too.
  const OccluderView occluders = options.visibility != Visibility::none
                                     ? view_of(scene.occluders, scene.cpu_scene.view(), trees_)
                                     : OccluderView{};
  const CutContext cut{trees_, light_set_,      visibility, min_distance * min_distance,
                       error,  options.max_cut, marks,      occluders};
  const HeapLighter heap(cut);
  PacketLighter packet(cut, cut_kernels(isa_), kernels_);
  const TileLighter& cut_lighter = options.cut == CutWalk::heap ? static_cast<const TileLighter&>(heap) : packet;
  const TileLighter& lighter = cuts ? cut_lighter : all_lights;
  const PathTracer paths(scene.cpu_scene, *scene.emitters, scene.tracer, options.bounces, options.seed);
  const TileFn render_tile = path ? path_tile(source, paths, progress) : lit_tile(source, lighter, progress);

  ++counts_.pictures;
  Film film(width, height, cuts);
  TileCounts counts, tested;
  std::uint32_t film_samples = samples;
  if (options.method == Method::instant_radiosity && options.visibility == Visibility::ism) {
    arena_.execute([&] { film_samples = light_by_maps(by_maps, film, progress, callback, counts, statistics); });
  } else if (maps != nullptr) {
    arena_.execute([&] { counts = maps->for_each_tile(view, film, progress, render_tile); });
    maps->report(statistics);
  } else {
    arena_.execute([&] {
      // A limited cut is off by more than a factor for the whole picture can mend.
      const bool calibrated = cuts && options.cut == CutWalk::packet && options.max_cut == 0;
      double gains = 0;
      DrawPerSample draw(trees_, cuts ? drawn_with_ : std::nullopt);
      counts = for_each_tile(view, film, progress, render_tile, [&](std::uint32_t sample) {
        if (draw(sample)) packet.representatives_changed();
        if (!calibrated) return;
        const CutTests tests = packet.calibrate(source, sample, drawn_with_.value_or(0), options.error, progress);
        tested.rays += tests.rays;
        tested.pairs += tests.pairs;
        gains += packet.gain() / samples;
      });
      counts = sum_of({counts, tested});
      if (calibrated && !progress.stopped()) statistics.cut.gain = gains;
    });
  }

  counts_.maps += statistics.shadow_maps.count;
  statistics.pairs = counts.pairs;
  statistics.rays = counts.rays;
  statistics.clamped = counts.lost > 0 ? counts.lost / (counts.light + counts.lost) : 0;
  if (cuts) {
    statistics.cut.mean =
        counts.cuts == 0 ? 0 : static_cast<double>(counts.cut_nodes) / static_cast<double>(counts.cuts);
    statistics.cut.max = counts.largest_cut;
    statistics.cut.at_limit =
        counts.cuts == 0 ? 0 : static_cast<double>(counts.cuts_at_limit) / static_cast<double>(counts.cuts);
    statistics.cut.lights_used = marks.count();
  }
  ShadeResult result;
  arena_.execute([&] { result.image = film.image(film_samples); });
  result.complete = find_channel(result.image, "weight") == nullptr;
  return result;
}

LightTrees build_trees_by_cpu(const Lights& lights, float scene_diagonal, const TreeOptions& options,
                              const ProgressFn& progress) {
  return build_light_trees(lights, scene_diagonal, options, progress);
}

std::unique_ptr<Backend> make_cpu_backend(int threads) { return std::make_unique<CpuBackend>(threads); }

}  // namespace lightcuts
