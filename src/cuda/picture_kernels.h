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

/// Adds the path-traced radiance of the samples [first, last) of every pixel to film.radiance.
void trace_paths(Device& device, const TracedScene& traced, const PixelGrid& grid, std::uint32_t first,
                 std::uint32_t last, int reflections, const FilmView& film);

}  // namespace lightcuts::cuda
