#include "cpu/ism/light_maps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <numeric>

#include "cpu/progress.h"
#include "kernels/morton.h"

namespace lightcuts {
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

void LightMaps::begin_picture() {
  rounds_ = 1;
  pool_.begin_picture();
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
  if (pool_.has_room_for_all()) {
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
  statistics.shadow_maps.size = maker_.options().size;
  statistics.shadow_maps.room = pool_.room();
  statistics.shadow_maps.count = pool_.made();
  statistics.shadow_maps.bytes = pool_.most() * maker_.bytes_per_map();
  statistics.shadow_maps.rounds = rounds_;
  statistics.time_ms.shadow_maps += pool_.making_ms() / threads_;
}

}  // namespace lightcuts
