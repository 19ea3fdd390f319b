#pragma once

#include "cuda/picture_kernels.h"
#include "cuda/pixels.h"
#include "lightcuts/image.h"

namespace lightcuts::cuda {

/// A picture's g-buffer and sums in a device's memory.
class DeviceFilm {
 public:
  /// `with_cuts`: keeps what cuts leave of each pixel too.
  DeviceFilm(Device& device, const PixelGrid& grid, bool with_cuts = false);

  [[nodiscard]] PixelView pixels() const;
  [[nodiscard]] FilmView film() const;
  /// Sums over lights, cleared by clear_sums.
  [[nodiscard]] Vec3T<double>* light() const { return light_.data(); }
  [[nodiscard]] double* lost() const { return lost_.data(); }
  [[nodiscard]] std::uint32_t* rays() const { return rays_.data(); }
  void clear_sums();

  // What cuts leave of one sample a pixel; null without cuts.
  [[nodiscard]] std::uint32_t* cut_size() const { return cut_size_.data(); }
  [[nodiscard]] float* cut_bound() const { return cut_bound_.data(); }
  [[nodiscard]] std::uint8_t* cut_at_limit() const { return cut_at_limit_.data(); }
  /// Adds the sample's cuts to the picture's planes.
  void add_cuts();

  /// Over all pixels, since clear_sums.
  [[nodiscard]] PictureTotals totals() const;

  /// R G B, albedo.*, normal.*, depth.Z as the CPU writes them. Every pixel has `planes` samples of the g-buffer and
  /// `samples` of radiance, of `wanted`; where fewer, there is a plane `weight`.
  [[nodiscard]] Image image(std::uint32_t planes, std::uint32_t samples, std::uint32_t wanted) const;

  static constexpr std::uint64_t bytes_per_pixel(bool with_cuts = false) {
    return (with_cuts ? 4 * sizeof(float) + 1 : 0) + sizeof(Vec3) * 7 + sizeof(float) * 2 + sizeof(std::uint32_t) * 2 +
           sizeof(double) * 7;
  }

 private:
  PixelGrid grid_;
  DeviceBuffer<Vec3> position_, ns_, ng_, albedo_, seen_, albedo_sum_, normal_sum_;
  DeviceBuffer<float> depth_, depth_sum_;
  DeviceBuffer<std::uint32_t> hits_, rays_;
  DeviceBuffer<Vec3T<double>> radiance_, light_;
  DeviceBuffer<double> lost_;
  Device* device_;
  bool with_cuts_;
  DeviceBuffer<std::uint32_t> cut_size_;
  DeviceBuffer<float> cut_bound_, cut_size_sum_, cut_bound_most_;
  DeviceBuffer<std::uint8_t> cut_at_limit_;
};

}  // namespace lightcuts::cuda
