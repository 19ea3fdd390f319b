#include "cpu/ism/light_by_maps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>

#include "cpu/all_lights.h"
#include "cpu/ism/map_plan.h"
#include "cpu/progress.h"
#include "kernels/morton.h"

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
  statistics.shadow_maps.room = (plan.maps + plan.batches - 1) / plan.batches;
  statistics.shadow_maps.rounds = plan.batches;
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

/// Tiles so that neighbours in the order are neighbours in the picture, which ask for the same maps.
std::vector<std::uint32_t> tiles_in_order(const View& view) {
  const auto columns = static_cast<std::uint32_t>(tile_columns(view));
  std::vector<std::uint32_t> tiles(static_cast<std::size_t>(tile_count(view)));
  std::iota(tiles.begin(), tiles.end(), 0u);
  const auto key = [columns](std::uint32_t tile) {
    return spread_bits(tile % columns) << 1 | spread_bits(tile / columns);
  };
  std::sort(tiles.begin(), tiles.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  return tiles;
}

}  // namespace

LightMaps::LightMaps(const MapLighting& lighting, int threads, Statistics& statistics)
    : threads_(threads),
      room_(plan_pool(lighting.lights, point_options(lighting.options), shadow_map_options(lighting.options), threads,
                      lighting.memory_bytes)),
      start_(Clock::now()),
      points_(lighting.source.scene, point_options(lighting.options)),
      points_ms_(ms_since(start_)),
      maker_(lighting.ism, points_, lighting.lights, shadow_map_options(lighting.options)),
      pool_(maker_, room_, threads) {
  statistics.shadow_maps.size = lighting.options.ism_size;
  statistics.shadow_maps.room = room_;
}

/// Lights tiles until all are done or the pool is full; those that are not done stay in `todo`.
bool LightMaps::light_round(const Round& round, std::vector<std::uint32_t>& todo) {
  std::vector<std::uint8_t> done(todo.size(), 0);
  std::atomic<std::size_t> next{0};
  std::atomic<bool> full{false};
  const auto light_some = [&](int) {
    while (!full.load(std::memory_order_relaxed) && !round.progress.stopped()) {
      const std::size_t i = next.fetch_add(1);
      if (i >= todo.size()) return;
      const auto column = static_cast<int>(todo[i]) % round.columns, row = static_cast<int>(todo[i]) / round.columns;
      try {
        round.render_tile(column * kTileSide, row * kTileSide, round.sample, round.film, round.counts[todo[i]]);
        done[i] = 1;
      } catch (const PoolIsFull&) {
        full = true;
      }
    }
  };
  tbb::parallel_for(0, threads_, light_some, tbb::simple_partitioner());
  std::size_t left = 0;
  for (std::size_t i = 0; i < todo.size(); ++i) {
    if (done[i] == 0) todo[left++] = todo[i];
  }
  const bool some_done = left < todo.size();
  todo.resize(left);
  return some_done;
}

TileCounts LightMaps::for_each_tile(const View& view, Film& film, Progress& progress, const TileFn& render_tile) {
  if (pool_.room() >= MapMaker::maps_of(maker_.lights())) {
    return lightcuts::for_each_tile(view, film, progress, render_tile);
  }
  const std::vector<std::uint32_t> tiles = tiles_in_order(view);
  std::vector<TileCounts> counts(tiles.size());
  for (std::uint32_t sample = 0; sample < view.sample_count && !progress.stopped(); ++sample) {
    const Round round{render_tile, sample, tile_columns(view), film, progress, counts};
    std::vector<std::uint32_t> todo = tiles;
    while (!progress.stopped()) {
      const bool some_done = light_round(round, todo);
      if (todo.empty() || progress.stopped()) break;
      ++rounds_;
      some_done ? pool_.clear() : pool_.divide();
    }
  }
  return sum_of(counts);
}

void LightMaps::report(Statistics& statistics) const {
  statistics.shadow_maps.count = pool_.made();
  statistics.shadow_maps.bytes = pool_.most() * maker_.bytes_per_map();
  statistics.shadow_maps.rounds = rounds_;
  statistics.time_ms.shadow_maps = points_ms_ + pool_.making_ms() / threads_;
}

}  // namespace lightcuts
