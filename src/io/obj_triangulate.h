#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lightcuts/math.h"

namespace lightcuts::obj {

/// Cuts polygons into triangles: convex ones by halving, others by clipping ears.
///
/// Holds for concave polygons, corners in a line, repeated corners and bridges to holes; polygons that cross themselves
/// or have no plane give some triangles between their corners. Source: Meisters, "Polygons have ears", 1975.
class Triangulator {
 public:
  using Triangle = std::array<std::uint32_t, 3>;

  /// Triangles of the polygon as indices into `corners`, in its orientation; valid until the next call.
  /// None of them is flat unless all are.
  const std::vector<Triangle>& triangulate(std::span<const Vec3> corners);

  /// True once polygons were so large that the rest was cut without looking for ears: clipping is quadratic, and all
  /// polygons of one object share a budget that grows with their corners.
  [[nodiscard]] bool gave_up() const { return gave_up_; }

 private:
  struct Point {
    double x = 0, y = 0;
    bool operator==(const Point&) const = default;
  };

  bool project(std::span<const Vec3> corners);
  [[nodiscard]] bool is_convex() const;
  void halve(std::uint32_t first, std::uint32_t last);
  void clip_ears();
  void clip(std::uint32_t corner);
  enum class Ear { clear, touching, any };  ///< how strictly a corner must be an ear
  bool is_ear(std::uint32_t corner, Ear kind);
  [[nodiscard]] double area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  std::vector<Point> points_;  ///< counter-clockwise in the plane
  std::vector<std::uint32_t> previous_, next_, reflex_;
  std::vector<Triangle> triangles_;
  std::uint64_t budget_ = 30'000'000;  ///< tests of a point against a triangle that may still be made
  bool gave_up_ = false;
};

}  // namespace lightcuts::obj
