#pragma once

#include "cuda/pixels.h"
#include "lightcuts/image.h"

namespace lightcuts::cuda {

/// A picture's g-buffer and sums in a device's memory.
class DeviceFilm {
 public:
  DeviceFilm(Device& device, const PixelGrid& grid);

  [[nodiscard]] PixelView pixels() const;
  [[nodiscard]] FilmView film() const;
  /// Sums over lights, cleared by clear_sums.
  [[nodiscard]] Vec3T<double>* light() const { return light_.data(); }
  [[nodiscard]] double* lost() const { return lost_.data(); }
  [[nodiscard]] std::uint32_t* rays() const { return rays_.data(); }
  void clear_sums();

  /// Luminance of the sums over lights, what the clamp took of them, and shadow rays, over all pixels, since
  /// clear_sums.
  struct Totals {
    double light = 0, lost = 0;
    std::uint64_t rays = 0;
  };
  [[nodiscard]] Totals totals() const;

  /// R G B, albedo.*, normal.*, depth.Z as the CPU writes them. Every pixel has `planes` samples of the g-buffer and
  /// `samples` of radiance, of `wanted`; where fewer, there is a plane `weight`.
  [[nodiscard]] Image image(std::uint32_t planes, std::uint32_t samples, std::uint32_t wanted) const;

  static constexpr std::uint64_t bytes_per_pixel() {
    return sizeof(Vec3) * 7 + sizeof(float) * 2 + sizeof(std::uint32_t) * 2 + sizeof(double) * 7;
  }

 private:
  PixelGrid grid_;
  DeviceBuffer<Vec3> position_, ns_, ng_, albedo_, seen_, albedo_sum_, normal_sum_;
  DeviceBuffer<float> depth_, depth_sum_;
  DeviceBuffer<std::uint32_t> hits_, rays_;
  DeviceBuffer<Vec3T<double>> radiance_, light_;
  DeviceBuffer<double> lost_;
};

}  // namespace lightcuts::cuda
