#include "cuda/film.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <type_traits>

#include "backend/picture_planes.h"
#include "cuda/picture_kernels.h"

namespace lightcuts::cuda {
namespace {

/// What lies in the device's memory, fetched. Not set to zero before, which would cost as much as the fetching.
template <class T>
class Fetched {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  explicit Fetched(const DeviceBuffer<T>& buffer) : bytes_(new std::byte[buffer.size() * sizeof(T)]) {
    buffer.download(reinterpret_cast<T*>(bytes_.get()), buffer.size());
  }
  const T& operator[](std::size_t i) const { return reinterpret_cast<const T*>(bytes_.get())[i]; }

 private:
  std::unique_ptr<std::byte[]> bytes_;
};

}  // namespace

DeviceFilm::DeviceFilm(Device& device, const PixelGrid& grid, bool with_cuts)
    : grid_(grid), device_(&device), with_cuts_(with_cuts) {
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
  if (with_cuts) {
    cut_size_ = DeviceBuffer<std::uint32_t>(device, n);
    cut_at_limit_ = DeviceBuffer<std::uint8_t>(device, n);
    for (DeviceBuffer<float>* v : {&cut_bound_, &cut_size_sum_, &cut_bound_most_}) {
      *v = DeviceBuffer<float>(device, n);
      v->fill_bytes(0);
    }
  }
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

void DeviceFilm::add_cuts() {
  add_cut_planes(*device_, grid_, {cut_size_.data(), cut_bound_.data()}, cut_size_sum_.data(), cut_bound_most_.data());
}

PictureTotals DeviceFilm::totals() const {
  return sum_picture(*device_, grid_,
                     {light_.data(), lost_.data(), rays_.data(), cut_size_.data(), cut_at_limit_.data()});
}

Image DeviceFilm::image(std::uint32_t planes, std::uint32_t samples, std::uint32_t wanted) const {
  Image image = make_picture(grid_.width, grid_.height, with_cuts_);
  if (samples < wanted) {
    auto& weight = mark_incomplete(image).values;
    std::fill(weight.begin(), weight.end(), static_cast<float>(samples) / static_cast<float>(wanted));
  }
  const Fetched radiance(radiance_);
  const Fetched albedo(albedo_sum_), normal(normal_sum_);
  const Fetched depth(depth_sum_);
  const Fetched hits(hits_);
  const Fetched cut_size(cut_size_sum_), cut_bound(cut_bound_most_);
  const double share = samples > 0 ? 1.0 / samples : 0.0;
  const float plane_share = planes > 0 ? 1.0f / static_cast<float>(planes) : 0.0f;
  const auto write = [&](std::uint32_t slot) {
    const std::int32_t x = grid_.x_of(slot), y = grid_.y_of(slot);
    if (x >= grid_.width || y >= grid_.height) return;
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width) + static_cast<std::size_t>(x);
    PixelPlanes values{radiance[slot] * share, albedo[slot] * plane_share, normal[slot] * plane_share};
    if (hits[slot] > 0) values.depth = depth[slot] / static_cast<float>(hits[slot]);
    if (with_cuts_) {
      values.cut_size = cut_size[slot] * plane_share;
      values.cut_bound = cut_bound[slot];
    }
    set_pixel(image, pixel, values, with_cuts_);
  };
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, grid_.slot_count()), [&](const auto& slots) {
    for (std::uint32_t slot = slots.begin(); slot < slots.end(); ++slot) write(slot);
  });
  return image;
}

}  // namespace lightcuts::cuda
