#include "io/obj_triangulate.h"

#include <algorithm>
#include <cmath>

namespace lightcuts::obj {

double Triangulator::area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const Point &p = points_[a], &q = points_[b], &r = points_[c];
  return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
}

void Triangulator::emit(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (area(a, b, c) != 0) triangles_.push_back({a, b, c});
}

/// Drops the axis along which the polygon is seen largest; false if it has no plane.
bool Triangulator::project(std::span<const Vec3> corners) {
  // Newell's normal, relative to the first corner: coordinates far from the origin lose nothing.
  using Vec3d = Vec3T<double>;
  const auto at = [&](std::size_t i) {
    const Vec3 p = corners[i], o = corners[0];
    return Vec3d{double{p.x} - o.x, double{p.y} - o.y, double{p.z} - o.z};
  };
  Vec3d normal{};
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) normal += cross(at(i), at(i + 1));
  const double x = std::fabs(normal.x), y = std::fabs(normal.y), z = std::fabs(normal.z);
  const double largest = std::max({x, y, z});
  if (!(largest > 0) || !std::isfinite(largest)) return false;

  points_.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d p = at(i);
    Point& point = points_[i];
    if (largest == z) {
      point = normal.z > 0 ? Point{p.x, p.y} : Point{p.y, p.x};
    } else if (largest == y) {
      point = normal.y > 0 ? Point{p.z, p.x} : Point{p.x, p.z};
    } else {
      point = normal.x > 0 ? Point{p.y, p.z} : Point{p.z, p.y};
    }
  }
  return true;
}

/// Turns left everywhere and goes round once: x changes its direction twice.
bool Triangulator::is_convex() const {
  const auto n = static_cast<std::uint32_t>(points_.size());
  int turns = 0, last_sign = 0, first_sign = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = i + 1 < n ? i + 1 : 0, k = j + 1 < n ? j + 1 : 0;
    if (area(i, j, k) < 0) return false;
    const double step = points_[j].x - points_[i].x;
    if (step == 0) {
      if (points_[j].y == points_[i].y) return false;
      continue;
    }
    const int sign = step > 0 ? 1 : -1;
    if (first_sign == 0) first_sign = sign;
    if (last_sign != 0 && sign != last_sign) ++turns;
    last_sign = sign;
  }
  if (last_sign != first_sign) ++turns;
  return turns == 2;
}

/// Better shaped triangles than a fan, of a chain of corners and the edge that closes it.
void Triangulator::halve(std::uint32_t first, std::uint32_t last) {
  if (last - first < 2) return;
  const std::uint32_t middle = first + (last - first) / 2;
  halve(first, middle);
  emit(first, middle, last);
  halve(middle, last);
}

bool Triangulator::is_ear(std::uint32_t corner, Ear kind) {
  const std::uint32_t a = previous_[corner], b = corner, c = next_[corner];
  budget_ -= std::min<std::uint64_t>(budget_, 1);
  const double size = area(a, b, c);
  if (kind == Ear::any) return true;
  if (kind == Ear::touching && size == 0) return true;  // a corner in a line, or the tip of a spike
  if (size <= 0) return false;
  for (const std::uint32_t i : reflex_) {
    if (i == a || i == b || i == c) continue;
    budget_ -= std::min<std::uint64_t>(budget_, 1);
    const Point& p = points_[i];
    if (p == points_[a] || p == points_[b] || p == points_[c]) continue;
    const double ab = area(a, b, i), bc = area(b, c, i), ca = area(c, a, i);
    const bool inside = kind == Ear::clear ? ab >= 0 && bc >= 0 && ca >= 0 : ab > 0 && bc > 0 && ca > 0;
    if (inside) return false;
  }
  return true;
}

void Triangulator::clip(std::uint32_t corner) {
  const std::uint32_t a = previous_[corner], c = next_[corner];
  emit(a, corner, c);
  next_[a] = c;
  previous_[c] = a;
  // A clipped corner is in nobody's way, and its neighbours may have become convex.
  std::erase_if(reflex_, [&](std::uint32_t i) {
    return i == corner || ((i == a || i == c) && area(previous_[i], i, next_[i]) > 0);
  });
}

void Triangulator::clip_ears() {
  const auto n = static_cast<std::uint32_t>(points_.size());
  previous_.resize(n);
  next_.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    previous_[i] = i > 0 ? i - 1 : n - 1;
    next_[i] = i + 1 < n ? i + 1 : 0;
  }
  reflex_.clear();
  for (std::uint32_t i = 0; i < n; ++i) {
    if (area(previous_[i], i, next_[i]) <= 0) reflex_.push_back(i);
  }

  std::uint32_t corner = 0, left = n, misses = 0;
  Ear kind = Ear::clear;
  while (left > 3 && budget_ > 0) {
    const std::uint32_t after = next_[corner];
    if (is_ear(corner, kind)) {
      budget_ -= std::min<std::uint64_t>(budget_, reflex_.size() / 8);
      clip(corner);
      --left;
      misses = 0;
      kind = Ear::clear;
    } else if (++misses > left) {
      kind = kind == Ear::clear ? Ear::touching : Ear::any;
      misses = 0;
    }
    corner = after;
  }
  if (left > 3) gave_up_ = true;
  // Three corners, or the fan of a polygon that is beyond the budget.
  for (std::uint32_t second = next_[corner]; next_[second] != corner; second = next_[second]) {
    emit(corner, second, next_[second]);
  }
}

const std::vector<Triangulator::Triangle>& Triangulator::triangulate(std::span<const Vec3> corners) {
  triangles_.clear();
  const auto n = static_cast<std::uint32_t>(corners.size());
  if (n == 3) {
    triangles_.push_back({0, 1, 2});
  } else if (n > 3 && project(corners)) {
    constexpr std::uint64_t kTestsPerCorner = 64;  // plenty for the small polygons of large files
    budget_ += kTestsPerCorner * n;
    if (is_convex()) {
      halve(0, n - 1);
    } else {
      clip_ears();
    }
  }
  if (triangles_.empty()) {
    for (std::uint32_t i = 1; i + 1 < n; ++i) triangles_.push_back({0, i, i + 1});
  }
  return triangles_;
}

}  // namespace lightcuts::obj
