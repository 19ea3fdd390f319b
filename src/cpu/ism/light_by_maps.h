#pragma once

#include <chrono>

#include "cpu/ism/shadow_map_pool.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/shade_picture.h"
#include "cpu/simd/shade_kernels.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// What lighting by maps needs. Everything referred to must outlive the call.
struct MapLighting {
  const TileSource& source;
  const LightSet& lights;
  const ShadeKernels& shade;
  const IsmKernels& ism;
  const ShadeOptions& options;
  float min_distance;          ///< clamp of the VPL singularity [m]
  std::uint64_t memory_bytes;  ///< left for points and maps, 0: no limit
};

/// Points and maps of any light, made when a cut first looks one up.
class LightMaps {
 public:
  /// Plans and makes the points. Throws Error{out_of_memory} before anything is allocated.
  /// @param threads  of the TBB arena that will light tiles
  LightMaps(const MapLighting& lighting, int threads, Statistics& statistics);
  [[nodiscard]] const PacketVisibility* visibility() const { return &pool_; }

  /// As for_each_tile, in rounds where the maps that are asked for do not fit: tiles that found no room for a map are lit
  /// again when all others have stopped and the maps of the last round are forgotten. Where not even one tile's maps
  /// fit, each thread keeps a few of its own. The picture is the same in any case.
  TileCounts for_each_tile(const View& view, Film& film, Progress& progress, const TileFn& render_tile);

  /// Tells `statistics` of the maps that were made; their time is that of all threads over their number.
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
  std::size_t room_;
  std::chrono::steady_clock::time_point start_;
  SurfacePoints points_;
  double points_ms_;
  MapMaker maker_;
  ShadowMapPool pool_;
  std::uint64_t rounds_ = 1;
};

PointOptions point_options(const ShadeOptions& options);
ShadowMapOptions shadow_map_options(const ShadeOptions& options);

/// Instant Radiosity with visibility by imperfect shadow maps.
///
/// In passes: a batch of lights (every n-th, so that a picture that was stopped shows all kinds), their maps, then all
/// tiles and samples; the picture is the mean of the passes. Returns how many samples a pixel there are in the film, which
/// is passes times camera samples. `statistics` receives shadow_maps and its time. Runs on the caller's TBB arena.
/// Throws Error{out_of_memory} before anything is allocated.
std::uint32_t light_by_maps(const MapLighting& lighting, Film& film, Progress& progress, const ProgressFn& callback,
                            TileCounts& counts, Statistics& statistics);

}  // namespace lightcuts
