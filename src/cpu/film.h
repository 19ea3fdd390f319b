#pragma once

#include <cstdint>

#include "backend/picture_planes.h"
#include "cpu/tile.h"
#include "cpu/zeroed_array.h"
#include "lightcuts/image.h"

namespace lightcuts {

/// Sums of camera samples, a pixel at a time, by a box filter. Threads may write to different pixels at once.
class Film {
 public:
  /// `with_cuts`: the picture gets the planes cut.size and cut.bound.
  Film(int width, int height, bool with_cuts = false);

  /// What a sample adds to a pixel. Normals in world space, as seen; depth infinite where nothing was hit.
  struct Sample {
    Vec3T<double> radiance;
    Vec3 albedo, normal;
    float depth;
    float cut_size = 0, cut_bound = 0;
  };
  void add(int x, int y, const Sample& sample);

  /// The picture: R G B, albedo.*, normal.* (means over the samples), depth.Z (mean over the samples that hit, infinite
  /// where none did), cut.size (mean) and cut.bound (largest). Where a pixel has fewer samples than `sample_count`, there is a plane `weight` with the share of
  /// them and the attribute complete = "false"; pixels without any are zero. Works with the threads of
  /// the caller's arena.
  [[nodiscard]] Image image(std::uint32_t sample_count) const;

  /// Bytes that a film and its picture take for each pixel.
  static constexpr std::uint64_t bytes_per_pixel() { return sizeof(Pixel) + 13 * sizeof(float); }

 private:
  struct Pixel {
    Vec3T<double> radiance;
    Vec3 albedo, normal;
    float depth = 0;
    std::uint32_t samples = 0, hits = 0;
    float cut_size = 0, cut_bound = 0;
  };

  [[nodiscard]] bool has_all_samples(std::uint32_t sample_count) const;
  static PixelPlanes mean_of(const Pixel& pixel);

  int width_, height_;
  bool with_cuts_;
  ZeroedArray<Pixel> pixels_;
};

}  // namespace lightcuts
