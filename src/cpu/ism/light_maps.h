#pragma once

#include "cpu/ism/shadow_map_pool.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/shade_picture.h"
#include "cpu/simd/ism_kernels.h"

namespace lightcuts {

/// Maps of any light, made when a cut first looks one up, and kept for the next picture.
class LightMaps {
 public:
  /// Everything referred to must outlive this; lights may change between pictures, as `forget` is told.
  /// @param room     maps at a time; see plan_pool
  /// @param threads  of the TBB arena that will light tiles
  LightMaps(const IsmKernels& kernels, const SurfacePoints& points, const LightSet& lights,
            const ShadowMapOptions& options, std::size_t room, int threads)
      : threads_(threads), maker_(kernels, points, lights, options), pool_(maker_, room, threads) {}

  [[nodiscard]] const PacketVisibility* visibility() const { return &pool_; }

  /// Whether this serves for other options and another room: then it has that room.
  bool serves(const ShadowMapOptions& options, std::size_t room) {
    return maker_.options() == options && pool_.change_room(room);
  }
  /// Counts anew what is reported.
  void begin_picture();
  /// Forgets the maps of lights.
  void forget(const LightIds& ids) { pool_.forget(ids); }
  [[nodiscard]] std::uint64_t bytes() const { return pool_.bytes(); }

  /// As lightcuts::for_each_tile, in rounds where the maps that are asked for do not fit: tiles that found no room for a map
  /// are lit again when all others have stopped and the maps of the last round are forgotten. Where not even one tile's maps
  /// fit, each thread keeps a few of its own. The picture is the same in any case.
  TileCounts for_each_tile(const View& view, Film& film, Progress& progress, const TileFn& render_tile);

  /// Tells `statistics` of the maps that were made; their time, that of all threads over their number, is added.
  void report(Statistics& statistics) const;

 private:
  /// What the tiles of a round have in common.
  struct Round {
    const TileFn& render_tile;
    std::uint32_t sample;
    int columns;
    Film& film;
    Progress& progress;
    std::vector<TileCounts>& counts;
  };
  bool light_round(const Round& round, std::vector<std::uint32_t>& todo);

  int threads_;
  MapMaker maker_;
  ShadowMapPool pool_;
  std::uint64_t rounds_ = 1;
};

}  // namespace lightcuts
