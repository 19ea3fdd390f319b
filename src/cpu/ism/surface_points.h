#pragma once

#include <cstdint>
#include <vector>

#include "cpu/simd/ism_kernels.h"
#include "kernels/scene_view.h"

namespace lightcuts {

/// How the scene is turned into points.
struct PointOptions {
  std::uint32_t per_map = 8000;  ///< points that a map is drawn from
  float overlap = 1.7f;  ///< radius of a disc relative to that of a circle with the area that a point stands for
  std::uint64_t seed = 1;

  bool operator==(const PointOptions&) const = default;
};

/// Points on all surfaces, evenly by area, in an order of which every block covers all surfaces evenly.
///
/// Point j lies at a scrambled van der Corput number of the total area: that names a triangle, and the rest of the number a
/// place in it by recursive subdivision. So a map takes a block of `per_map` points from anywhere and has few holes.
/// What an alpha mask cuts away has no points; instances are drawn like any triangle. Depends on nothing but scene and
/// options. Sources: Basu and Owen 2015, "Low discrepancy constructions in the triangle"; reference section 4.2.
class SurfacePoints {
 public:
  /// The view is not needed afterwards.
  SurfacePoints(const SceneView& scene, const PointOptions& options);

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] const PointArrays& arrays() const { return arrays_; }
  [[nodiscard]] const PointOptions& options() const { return options_; }
  [[nodiscard]] const Box& bounds() const { return bounds_; }
  [[nodiscard]] Vec3 position(std::size_t i) const { return {arrays_.x[i], arrays_.y[i], arrays_.z[i]}; }
  [[nodiscard]] Vec3 normal(std::size_t i) const {
    return {arrays_.normal_x[i], arrays_.normal_y[i], arrays_.normal_z[i]};
  }
  [[nodiscard]] double area() const { return area_; }  ///< of all surfaces that masks leave [m^2]

  [[nodiscard]] std::uint64_t bytes() const {
    return values_.size() * sizeof(float) + shape_.size() * sizeof(std::uint32_t) + shapes_.size() * sizeof(DiscShape);
  }

  /// How many points are made, and what they take at most [bytes].
  static std::size_t count_for(const PointOptions& options);
  static std::uint64_t bytes_for(const PointOptions& options);

  SurfacePoints(const SurfacePoints&) = delete;
  SurfacePoints& operator=(const SurfacePoints&) = delete;

 private:
  PointOptions options_;
  Box bounds_;
  std::size_t count_ = 0;
  double area_ = 0;
  std::vector<float> values_;
  std::vector<std::uint32_t> shape_;
  std::vector<DiscShape> shapes_;
  PointArrays arrays_{};
};

}  // namespace lightcuts
