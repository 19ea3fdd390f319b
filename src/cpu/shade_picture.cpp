#include "cpu/shade_picture.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

#include "cpu/path_tracer.h"
#include "cpu/progress.h"

namespace lightcuts {
namespace {

Vec3 get(const PacketVec3& packet, int lane) { return {packet.x[lane], packet.y[lane], packet.z[lane]}; }

Vec3T<double> to_double(Vec3 v) { return {v.x, v.y, v.z}; }

/// Calls visit(packet, index of the packet, lane, x, y) for each pixel of a tile that belongs to the picture.
template <class Visit>
void for_each_pixel(const Tile& tile, Visit visit) {
  for (int p = 0; p < kTilePackets; ++p) {
    const SurfacePacket& packet = tile.packets[static_cast<std::size_t>(p)];
    for (int lane = 0; lane < kPacketSize; ++lane) {
      if ((packet.inside_picture >> lane & 1u) == 0) continue;
      visit(packet, p, lane, tile.x0 + tile_x(p, lane), tile.y0 + tile_y(p, lane));
    }
  }
}

/// Reflects the light of a tile's receivers towards the camera and adds the sample to its pixels.
void add_to_film(const Tile& tile, const TileLight& lit, double scale, Film& film, TileCounts& counts) {
  const double reflect = 0.31830988618379067154 * scale;
  for_each_pixel(tile, [&](const SurfacePacket& packet, int p, int lane, int x, int y) {
    const int pixel = p * kPacketSize + lane;
    const Vec3 albedo = get(packet.albedo, lane);
    const Vec3T<double> reflected = to_double(albedo) * lit.light[pixel] * reflect;
    film.add(x, y,
             {reflected + to_double(get(packet.seen, lane)), albedo, get(packet.receivers.ns, lane), packet.depth[lane],
              static_cast<float>(lit.cut_size[pixel]), lit.cut_bound[pixel]});
    counts.light += luminance(lit.light[pixel]);
    counts.lost += lit.lost[pixel];
    if (lit.cut_size[pixel] == 0) return;
    ++counts.cuts;
    counts.cut_nodes += lit.cut_size[pixel];
    counts.largest_cut = std::max<std::uint64_t>(counts.largest_cut, lit.cut_size[pixel]);
    counts.cuts_at_limit += lit.cut_at_limit[pixel] ? 1 : 0;
  });
  counts.pairs += lit.pairs;
  counts.rays += lit.rays;
}

int rows_of(const View& view) { return (view.height + kTileSide - 1) / kTileSide; }

}  // namespace

TileCounts for_each_tile(const View& view, Film& film, Progress& progress, const TileFn& render_tile,
                         const SampleFn& begin_sample) {
  const int columns = tile_columns(view);
  std::vector<TileCounts> counts(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows_of(view)));
  for (std::uint32_t sample = 0; sample < view.sample_count && !progress.stopped(); ++sample) {
    if (begin_sample) begin_sample(sample);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, counts.size(), 1),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i != range.end() && !progress.stopped(); ++i) {
                          const int column = static_cast<int>(i) % columns, row = static_cast<int>(i) / columns;
                          render_tile(column * kTileSide, row * kTileSide, sample, film, counts[i]);
                        }
                      });
  }
  return sum_of(counts);
}

TileCounts sum_of(const std::vector<TileCounts>& counts) {
  TileCounts total;
  for (const TileCounts& c : counts) {
    total.pairs += c.pairs;
    total.rays += c.rays;
    total.light += c.light;
    total.lost += c.lost;
    total.cuts += c.cuts;
    total.cut_nodes += c.cut_nodes;
    total.largest_cut = std::max(total.largest_cut, c.largest_cut);
    total.cuts_at_limit += c.cuts_at_limit;
  }
  return total;
}

int tile_columns(const View& view) { return (view.width + kTileSide - 1) / kTileSide; }
double tile_count(const View& view) { return static_cast<double>(tile_columns(view)) * rows_of(view); }

TileFn lit_tile(const TileSource& source, const TileLighter& lighter, Progress& progress, std::size_t passes) {
  return [source, &lighter, &progress, passes](int x0, int y0, std::uint32_t sample, Film& film, TileCounts& counts) {
    const Tile tile = trace_tile(source.view, x0, y0, sample, source.scene, source.tracer, source.emitters);
    TileLight lit;
    if (!lighter.light(tile, progress, lit)) return;
    add_to_film(tile, lit, static_cast<double>(passes), film, counts);
  };
}

TileFn path_tile(const TileSource& source, const PathTracer& paths, Progress& progress) {
  return [source, &paths, &progress](int x0, int y0, std::uint32_t sample, Film& film, TileCounts&) {
    const Tile tile = trace_tile(source.view, x0, y0, sample, source.scene, source.tracer, source.emitters);
    for_each_pixel(tile, [&](const SurfacePacket& packet, int, int lane, int x, int y) {
      film.add(x, y,
               {to_double(paths.radiance(source.view.camera, x, y, sample)), get(packet.albedo, lane),
                get(packet.receivers.ns, lane), packet.depth[lane]});
    });
    progress.advance(1);
  };
}

}  // namespace lightcuts
