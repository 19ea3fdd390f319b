#include "backend/picture_planes.h"

#include <algorithm>
#include <cmath>

namespace lightcuts {
namespace {

/// Single precision, kept finite: lights of absurd strength must not leave infinities (or, multiplied by a black albedo,
/// NaN) in a picture.
float finite(double v) {
  constexpr double largest = std::numeric_limits<float>::max();
  return std::isnan(v) ? 0.0f : static_cast<float>(std::clamp(v, -largest, largest));
}

}  // namespace

Image make_picture(int width, int height, bool with_cuts) {
  Image picture = make_rgb_image(width, height);
  for (const char* name : {"albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z", "depth.Z"}) {
    ensure_channel(picture, name);
  }
  if (with_cuts) {
    ensure_channel(picture, "cut.size");
    ensure_channel(picture, "cut.bound");
  }
  return picture;
}

void set_pixel(Image& picture, std::size_t pixel, const PixelPlanes& planes, bool with_cuts) {
  const float values[] = {
      finite(planes.radiance.x), finite(planes.radiance.y), finite(planes.radiance.z), planes.albedo.x, planes.albedo.y,
      planes.albedo.z,           planes.normal.x,           planes.normal.y,           planes.normal.z, planes.depth,
      planes.cut_size,           planes.cut_bound};
  const std::size_t count = with_cuts ? 12 : 10;
  for (std::size_t plane = 0; plane < count; ++plane) picture.channels[plane].values[pixel] = values[plane];
}

Channel& mark_incomplete(Image& picture) {
  picture.attributes["complete"] = "false";
  return ensure_channel(picture, "weight");
}

}  // namespace lightcuts
