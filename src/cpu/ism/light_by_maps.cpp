#include "cpu/ism/light_by_maps.h"

#include <algorithm>
#include <chrono>

#include "cpu/all_lights.h"
#include "cpu/ism/map_plan.h"
#include "cpu/progress.h"

namespace lightcuts {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void add(TileCounts& sum, const TileCounts& counts) {
  sum.pairs += counts.pairs;
  sum.rays += counts.rays;
  sum.light += counts.light;
  sum.lost += counts.lost;
}

PointOptions point_options(const ShadeOptions& options) {
  PointOptions points;
  points.per_map = static_cast<std::uint32_t>(options.ism_points);
  points.seed = options.seed;
  return points;
}

ShadowMapOptions shadow_map_options(const ShadeOptions& options) {
  return {options.ism_size, options.ism_depth_bits, options.ism_levels,
          options.ism_fill, options.ism_choice,     options.seed};
}

void make_points(const MapLighting& lighting, Statistics& statistics) {
  const Clock::time_point start = Clock::now();
  lighting.kept.points(lighting.source.scene, point_options(lighting.options), lighting.stages);
  statistics.time_ms.shadow_maps += ms_since(start);
}

}  // namespace

LightMaps& maps_for_cuts(const MapLighting& lighting, int threads, Statistics& statistics) {
  const ShadowMapOptions maps = shadow_map_options(lighting.options);
  const std::size_t room =
      plan_pool(lighting.lights, point_options(lighting.options), maps, threads, lighting.memory_bytes);
  make_points(lighting, statistics);
  return lighting.kept.for_cuts(lighting.ism, lighting.lights, maps, room, threads);
}

std::uint32_t light_by_maps(const MapLighting& lighting, Film& film, Progress& progress, const ProgressFn& callback,
                            TileCounts& counts, Statistics& statistics) {
  const ShadeOptions& options = lighting.options;
  const ShadowMapOptions wanted_maps = shadow_map_options(options);
  const MapPlan plan = plan_maps(lighting.lights, point_options(options), wanted_maps, lighting.memory_bytes);
  make_points(lighting, statistics);
  std::vector<std::unique_ptr<ShadowMapSet>>& sets =
      lighting.kept.for_all(lighting.ism, lighting.lights, wanted_maps, plan.keeps_all ? plan.batches : 1);
  Progress making(callback, "shadow maps", static_cast<double>(std::max<std::uint64_t>(1, plan.maps)));
  statistics.shadow_maps.size = options.ism_size;
  statistics.shadow_maps.room = plan.keeps_all ? plan.maps : (plan.maps + plan.batches - 1) / plan.batches;
  statistics.shadow_maps.rounds = plan.batches;

  for (std::size_t batch = 0; batch < plan.batches && !progress.stopped(); ++batch) {
    const Clock::time_point start = Clock::now();
    ShadowMapSet& maps = *sets[plan.keeps_all ? batch : 0];
    if (!plan.keeps_all) maps.clear();
    const std::size_t before = maps.map_count();
    const bool made = maps.add(every_light(lighting.lights, batch, plan.batches), &making);
    statistics.time_ms.shadow_maps += ms_since(start);
    if (!made) break;
    statistics.shadow_maps.count += maps.map_count() - before;
    statistics.shadow_maps.bytes = maps.bytes() + (plan.keeps_all ? statistics.shadow_maps.bytes : 0);

    const ShadowMapVisibility visibility(maps);
    const AllLights lighter(lighting.shade, lighting.lights, &visibility, lighting.min_distance, {batch, plan.batches});
    add(counts, for_each_tile(lighting.source.view, film, progress,
                              lit_tile(lighting.source, lighter, progress, plan.batches)));
  }
  return lighting.source.view.sample_count * static_cast<std::uint32_t>(plan.batches);
}

}  // namespace lightcuts
