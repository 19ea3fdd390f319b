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

}  // namespace

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

std::uint32_t light_by_maps(const MapLighting& lighting, Film& film, Progress& progress, const ProgressFn& callback,
                            TileCounts& counts, Statistics& statistics) {
  const ShadeOptions& options = lighting.options;
  const PointOptions wanted_points = point_options(options);
  const ShadowMapOptions wanted_maps = shadow_map_options(options);
  const MapPlan plan = plan_maps(lighting.lights, wanted_points, wanted_maps, lighting.memory_bytes);

  Clock::time_point start = Clock::now();
  const SurfacePoints points(lighting.source.scene, wanted_points);
  ShadowMapSet maps(lighting.ism, points, lighting.lights, wanted_maps);
  Progress making(callback, "shadow maps", static_cast<double>(std::max<std::uint64_t>(1, plan.maps)));
  statistics.shadow_maps.size = options.ism_size;
  statistics.time_ms.shadow_maps = ms_since(start);

  for (std::size_t batch = 0; batch < plan.batches && !progress.stopped(); ++batch) {
    start = Clock::now();
    maps.clear();
    const bool made = maps.add(every_light(lighting.lights, batch, plan.batches), &making);
    statistics.time_ms.shadow_maps += ms_since(start);
    if (!made) break;
    statistics.shadow_maps.count += maps.map_count();
    statistics.shadow_maps.bytes = maps.bytes();

    const ShadowMapVisibility visibility(maps);
    const AllLights lighter(lighting.shade, lighting.lights, &visibility, lighting.min_distance, {batch, plan.batches});
    add(counts, for_each_tile(lighting.source.view, film, progress,
                              lit_tile(lighting.source, lighter, progress, plan.batches)));
  }
  return lighting.source.view.sample_count * static_cast<std::uint32_t>(plan.batches);
}

namespace {

PointOptions checked_points(const MapLighting& lighting) {
  const PointOptions points = point_options(lighting.options);
  require_all_maps(lighting.lights, points, shadow_map_options(lighting.options), lighting.memory_bytes);
  return points;
}

}  // namespace

LightMaps::LightMaps(const MapLighting& lighting, Statistics& statistics)
    : points_(lighting.source.scene, checked_points(lighting)),
      maps_(lighting.ism, points_, lighting.lights, shadow_map_options(lighting.options)),
      visibility_(maps_) {
  maps_.reserve_all();
  statistics.shadow_maps.size = lighting.options.ism_size;
}

void LightMaps::report(Statistics& statistics) const {
  statistics.shadow_maps.count = maps_.map_count();
  statistics.shadow_maps.bytes = maps_.bytes();
}

}  // namespace lightcuts
