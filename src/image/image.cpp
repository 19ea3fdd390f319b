#include "lightcuts/image.h"

#include <algorithm>

#include "lightcuts/error.h"

namespace lightcuts {

const Channel* find_channel(const Image& image, std::string_view name) {
  const auto found = std::find_if(image.channels.begin(), image.channels.end(),
                                  [&](const Channel& channel) { return channel.name == name; });
  return found == image.channels.end() ? nullptr : &*found;
}

Channel* find_channel(Image& image, std::string_view name) {
  return const_cast<Channel*>(find_channel(static_cast<const Image&>(image), name));
}

Channel& ensure_channel(Image& image, std::string_view name) {
  if (Channel* found = find_channel(image, name)) return *found;
  return image.channels.emplace_back(Channel{std::string(name), std::vector<float>(image.pixel_count(), 0.0f)});
}

Image make_rgb_image(int width, int height) {
  if (width < 1 || height < 1) throw Error(Code::invalid_argument, "an image needs at least one pixel a side");
  Image image;
  image.width = width;
  image.height = height;
  for (const char* name : {"R", "G", "B"}) ensure_channel(image, name);
  return image;
}

std::vector<Vec3> rgb_pixels(const Image& image) {
  const Channel* r = find_channel(image, "R");
  const Channel* g = find_channel(image, "G");
  const Channel* b = find_channel(image, "B");
  if (r == nullptr || g == nullptr || b == nullptr) {
    r = find_channel(image, "Y");
    if (r == nullptr && image.channels.size() == 1) r = image.channels.data();
    if (r == nullptr) throw Error(Code::invalid_argument, "the image has neither the channels R, G, B nor Y");
    g = b = r;
  }
  std::vector<Vec3> pixels(image.pixel_count());
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = {r->values[i], g->values[i], b->values[i]};
  return pixels;
}

}  // namespace lightcuts
