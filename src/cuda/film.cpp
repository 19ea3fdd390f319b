#include "cuda/film.h"

#include <algorithm>
#include <cmath>

namespace lightcuts::cuda {
namespace {

template <class T>
std::vector<T> fetch(const DeviceBuffer<T>& buffer) {
  std::vector<T> values(buffer.size());
  buffer.download(values.data(), values.size());
  return values;
}

/// Single precision, kept finite.
float finite(double v) {
  constexpr double largest = std::numeric_limits<float>::max();
  return std::isnan(v) ? 0.0f : static_cast<float>(std::clamp(v, -largest, largest));
}

}  // namespace

DeviceFilm::DeviceFilm(Device& device, const PixelGrid& grid) : grid_(grid) {
  const std::size_t n = grid.slot_count();
  for (DeviceBuffer<Vec3>* v : {&position_, &ns_, &ng_, &albedo_, &seen_, &albedo_sum_, &normal_sum_}) {
    *v = DeviceBuffer<Vec3>(device, n);
    v->fill_bytes(0);
  }
  for (DeviceBuffer<float>* v : {&depth_, &depth_sum_}) {
    *v = DeviceBuffer<float>(device, n);
    v->fill_bytes(0);
  }
  for (DeviceBuffer<std::uint32_t>* v : {&hits_, &rays_}) {
    *v = DeviceBuffer<std::uint32_t>(device, n);
    v->fill_bytes(0);
  }
  radiance_ = DeviceBuffer<Vec3T<double>>(device, n);
  radiance_.fill_bytes(0);
  light_ = DeviceBuffer<Vec3T<double>>(device, n);
  lost_ = DeviceBuffer<double>(device, n);
  clear_sums();
}

PixelView DeviceFilm::pixels() const {
  return {position_.data(), ns_.data(), ng_.data(), albedo_.data(), seen_.data(), depth_.data()};
}

FilmView DeviceFilm::film() const {
  return {radiance_.data(), albedo_sum_.data(), normal_sum_.data(), depth_sum_.data(), hits_.data()};
}

void DeviceFilm::clear_sums() {
  light_.fill_bytes(0);
  lost_.fill_bytes(0);
  rays_.fill_bytes(0);
}

DeviceFilm::Totals DeviceFilm::totals() const {
  Totals totals;
  for (const Vec3T<double>& v : fetch(light_)) totals.light += 0.2126 * v.x + 0.7152 * v.y + 0.0722 * v.z;
  for (const double v : fetch(lost_)) totals.lost += v;
  for (const std::uint32_t v : fetch(rays_)) totals.rays += v;
  return totals;
}

Image DeviceFilm::image(std::uint32_t planes, std::uint32_t samples, std::uint32_t wanted) const {
  Image image = make_rgb_image(grid_.width, grid_.height);
  for (const char* name : {"albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z", "depth.Z"}) {
    ensure_channel(image, name);
  }
  if (samples < wanted) {
    auto& weight = ensure_channel(image, "weight").values;
    std::fill(weight.begin(), weight.end(), static_cast<float>(samples) / static_cast<float>(wanted));
    image.attributes["complete"] = "false";
  }
  const auto radiance = fetch(radiance_);
  const auto albedo = fetch(albedo_sum_), normal = fetch(normal_sum_);
  const auto depth = fetch(depth_sum_);
  const auto hits = fetch(hits_);
  const double share = samples > 0 ? 1.0 / samples : 0.0;
  const float plane_share = planes > 0 ? 1.0f / static_cast<float>(planes) : 0.0f;
  for (std::uint32_t slot = 0; slot < grid_.slot_count(); ++slot) {
    const std::int32_t x = grid_.x_of(slot), y = grid_.y_of(slot);
    if (x >= grid_.width || y >= grid_.height) continue;
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width) + static_cast<std::size_t>(x);
    const float values[10] = {
        finite(radiance[slot].x * share), finite(radiance[slot].y * share),
        finite(radiance[slot].z * share), albedo[slot].x * plane_share,
        albedo[slot].y * plane_share,     albedo[slot].z * plane_share,
        normal[slot].x * plane_share,     normal[slot].y * plane_share,
        normal[slot].z * plane_share,     hits[slot] > 0 ? depth[slot] / static_cast<float>(hits[slot]) : kInfinity};
    for (std::size_t c = 0; c < 10; ++c) image.channels[c].values[pixel] = values[c];
  }
  return image;
}

}  // namespace lightcuts::cuda
