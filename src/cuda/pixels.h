#pragma once

#include <cstdint>

#include "cuda/device.h"
#include "kernels/camera.h"
#include "kernels/scene_view.h"

namespace lightcuts::cuda {

/// A warp's pixels: 8 wide, 4 high.
inline constexpr int kTileWidth = 8, kTileHeight = 4;
inline constexpr std::uint32_t kTilePixels = kTileWidth * kTileHeight;

/// How a picture is looked at, and in which order its pixels lie in memory: tile after tile, so that the lanes of a warp
/// are neighbours and their loads are one. Tiles at the right and lower edge are padded.
struct PixelGrid {
  CameraView camera;
  Vec3 axis;  ///< unit, the way the camera looks
  std::int32_t width = 0, height = 0;
  std::uint32_t tiles_across = 0, tile_count = 0;
  std::uint64_t seed = 1;
  bool centred = true;

  [[nodiscard]] LC_FN std::uint32_t slot_count() const { return tile_count * kTilePixels; }
  [[nodiscard]] LC_FN std::int32_t x_of(std::uint32_t slot) const {
    return static_cast<std::int32_t>(slot / kTilePixels % tiles_across * kTileWidth + slot % kTileWidth);
  }
  [[nodiscard]] LC_FN std::int32_t y_of(std::uint32_t slot) const {
    return static_cast<std::int32_t>(slot / kTilePixels / tiles_across * kTileHeight + slot / kTileWidth % kTileHeight);
  }
};
PixelGrid make_pixel_grid(const Camera& camera, int width, int height, std::uint64_t seed, bool centred);

/// What one sample a pixel sees. Slots outside the picture and pixels that see nothing have zero normals, so that no
/// light reaches them.
struct PixelView {
  Vec3* position;  ///< off its triangle by the rounding error: shadow rays start here [m]
  Vec3* ns;
  Vec3* ng;
  Vec3* albedo;
  Vec3* seen;    ///< radiance seen directly, of an emitter or of the environment
  float* depth;  ///< along the view direction [m]; infinite where nothing was hit
};

/// Sums over a pixel's samples.
struct FilmView {
  Vec3T<double>* radiance;
  Vec3* albedo;
  Vec3* normal;
  float* depth;
  std::uint32_t* hits;
};

}  // namespace lightcuts::cuda
