#pragma once

#include <functional>
#include <vector>

#include "cpu/film.h"
#include "cpu/tile_lighter.h"
#include "lightcuts/render.h"

namespace lightcuts {

class PathTracer;
class Progress;
class RayTracer;

/// What a tile adds to the statistics.
struct TileCounts {
  std::uint64_t pairs = 0, rays = 0;
  double light = 0, lost = 0;  ///< luminance of the sums over lights, and of what the clamp took
  std::uint64_t cuts = 0, cut_nodes = 0, largest_cut = 0, cuts_at_limit = 0;
};

/// Renders one sample a pixel of the tile whose corner is (x0, y0) into the film; a tile that was stopped
/// on the way adds nothing.
using TileFn = std::function<void(int x0, int y0, std::uint32_t sample, Film& film, TileCounts& counts)>;

/// What comes before every sample of the picture.
using SampleFn = std::function<void(std::uint32_t sample)>;

/// Runs over all tiles and samples, one sample of every pixel before the next, so that stopping early leaves an even
/// picture. The order in which sums are made does not depend on threads.
///
/// Runs on the TBB arena of the caller. Reports one unit of work a tile and sample through `render_tile`.
TileCounts for_each_tile(const View& view, Film& film, Progress& progress, const TileFn& render_tile,
                         const SampleFn& begin_sample = {});

/// What all tiles together added.
TileCounts sum_of(const std::vector<TileCounts>& counts);

/// How many tiles a picture has, and how many of them are in a row; tiles are numbered row by row.
double tile_count(const View& view);
int tile_columns(const View& view);

/// Where a tile's g-buffer comes from. Everything referred to must outlive this and what is made of it.
struct TileSource {
  const View& view;
  const SceneView& scene;
  const RayTracer& tracer;
  const EmitterView& emitters;
};

/// A TileFn for methods that light a g-buffer: traces a tile's camera rays, lights it, adds what is seen directly.
///
/// `passes`: how many such passes the picture's mean is made of, where each sums a part of the lights; its light is
/// multiplied by it.
TileFn lit_tile(const TileSource& source, const TileLighter& lighter, Progress& progress, std::size_t passes = 1);

/// A TileFn for path tracing; the g-buffer serves the planes beside colour.
TileFn path_tile(const TileSource& source, const PathTracer& paths, Progress& progress);

}  // namespace lightcuts
