#pragma once

#include "cuda/device.h"
#include "cuda/pixels.h"
#include "kernels/emitters.h"
#include "kernels/wide_bvh.h"

namespace lightcuts::cuda {

/// What every kernel that follows rays is given.
struct TracedScene {
  SceneView scene;
  WideBvhView bvh;
  EmitterView emitters;
};

/// Traces one camera ray a pixel.
void trace_pixels(Device& device, const TracedScene& traced, const PixelGrid& grid, std::uint32_t sample,
                  const PixelView& pixels);

/// Adds a sample to the film: what is seen directly and albedo / pi times `light` (or nothing where it is null).
void add_sample(Device& device, const PixelGrid& grid, const PixelView& pixels, const Vec3T<double>* light,
                const FilmView& film);

/// What lighting one sample a pixel left; cut_size and cut_at_limit are null where lights were not cut.
struct LitSample {
  const Vec3T<double>* light;
  const double* lost;
  const std::uint32_t* rays;
  const std::uint32_t* cut_size;
  const std::uint8_t* cut_at_limit;
};

/// Luminance of the sums over lights, what the clamp took of them, shadow rays and cuts, over all pixels.
struct PictureTotals {
  double light = 0, lost = 0;
  std::uint64_t rays = 0, cuts = 0, cut_nodes = 0, largest_cut = 0, cuts_at_limit = 0;
};
/// Sums in a fixed order; waits for the stream.
PictureTotals sum_picture(Device& device, const PixelGrid& grid, const LitSample& sample);

struct CutPlanes {
  const std::uint32_t* size;
  const float* bound;
};
/// Adds a sample's cut sizes to `size_sum`, and takes its bounds into `bound_most`.
void add_cut_planes(Device& device, const PixelGrid& grid, const CutPlanes& sample, float* size_sum, float* bound_most);

/// Adds the path-traced radiance of the samples [first, last) of every pixel to film.radiance.
void trace_paths(Device& device, const TracedScene& traced, const PixelGrid& grid, std::uint32_t first,
                 std::uint32_t last, int reflections, const FilmView& film);

}  // namespace lightcuts::cuda
