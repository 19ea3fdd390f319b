// Pictures: from camera rays to planes, by paths, all lights or cuts.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <vector>

#include "cuda/cuda_backend.h"
#include "cuda/film.h"
#include "cuda/loaded_scene.h"
#include "cuda/packet_cut_by_maps.h"
#include "cuda/picture_groups.h"
#include "kernels/cut_criterion.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

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
    prepare_maps(options, left - (cuts ? std::min(left, working_bytes(grid, options, left)) : 0));
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
