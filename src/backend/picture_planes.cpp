#include "backend/picture_planes.h"

#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <cmath>
#include <string_view>

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
  if (width < 1 || height < 1) return make_rgb_image(width, height);  // throws
  Image picture;
  picture.width = width;
  picture.height = height;
  for (const char* name : {"R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z",
                           "depth.Z", "cut.size", "cut.bound"}) {
    if (with_cuts || std::string_view(name).substr(0, 4) != "cut.") picture.channels.push_back({name, {}});
  }
  // Fresh memory costs more than all that is written to it: several threads share it.
  tbb::parallel_for_each(picture.channels, [&](Channel& channel) { channel.values.resize(picture.pixel_count()); });
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
