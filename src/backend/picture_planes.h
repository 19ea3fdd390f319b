#pragma once

#include <cstddef>
#include <limits>

#include "lightcuts/image.h"
#include "lightcuts/math.h"

namespace lightcuts {

/// What a picture says of one pixel.
struct PixelPlanes {
  Vec3T<double> radiance;
  Vec3 albedo, normal;                                   ///< means over the camera's samples
  float depth = std::numeric_limits<float>::infinity();  ///< mean over the samples that hit; infinite where none did
  float cut_size = 0;                                    ///< mean
  float cut_bound = 0;                                   ///< largest
};

/// A black picture with the planes R G B, albedo.*, normal.*, depth.Z and, for cuts, cut.size and cut.bound: the same
/// from every backend.
Image make_picture(int width, int height, bool with_cuts);

/// Sets one pixel of such a picture. Lights of absurd strength leave no infinity or NaN in its colour.
void set_pixel(Image& picture, std::size_t pixel, const PixelPlanes& planes, bool with_cuts);

/// Marks a picture as stopped early and gives it the plane `weight`, all zero: the share of the samples that were done.
Channel& mark_incomplete(Image& picture);

}  // namespace lightcuts
