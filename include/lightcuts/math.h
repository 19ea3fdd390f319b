#pragma once

#include <cmath>
#include <limits>

/// Marks a formula that CPU and GPU share. Every such function is pure, noexcept in effect, and safe to inline into
/// code for any instruction set: it is always inlined, so that no out-of-line copy compiled for AVX-512 can be the one
/// that the linker keeps for the baseline.
#if defined(__CUDACC__)
#define LC_FN __host__ __device__ __forceinline__ constexpr
#else
#define LC_FN [[gnu::always_inline]] constexpr
#endif

/// Marks a larger kernel that CPU and GPU share and that no SIMD lane runs: an ordinary inline function.
#if defined(__CUDACC__)
#define LC_KERNEL __host__ __device__ inline
#else
#define LC_KERNEL inline
#endif

namespace lightcuts {

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class T>
LC_FN T min_of(T a, T b) {
  return b < a ? b : a;
}
template <class T>
LC_FN T max_of(T a, T b) {
  return a < b ? b : a;
}
template <class T>
LC_FN T clamp_to(T v, T lo, T hi) {
  return min_of(max_of(v, lo), hi);
}

/// Two components: a texture coordinate or a point of the unit square.
struct Vec2 {
  float x = 0, y = 0;
};
LC_FN Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
LC_FN Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
LC_FN Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }

/// Three components of a number type: `float`, `double` in oracles, or a SIMD batch.
/// Serves points [m], directions (unit length unless said otherwise) and linear RGB.
template <class T>
struct Vec3T {
  T x{}, y{}, z{};
};
using Vec3 = Vec3T<float>;

template <class T>
LC_FN Vec3T<T> operator+(Vec3T<T> a, Vec3T<T> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
LC_FN Vec3T<T> operator-(Vec3T<T> a, Vec3T<T> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
LC_FN Vec3T<T> operator-(Vec3T<T> a) {
  return {-a.x, -a.y, -a.z};
}
/// Component by component: for RGB.
template <class T>
LC_FN Vec3T<T> operator*(Vec3T<T> a, Vec3T<T> b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
template <class T>
LC_FN Vec3T<T> operator*(Vec3T<T> a, T s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class T>
LC_FN Vec3T<T> operator*(T s, Vec3T<T> a) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class T>
LC_FN Vec3T<T> operator/(Vec3T<T> a, T s) {
  return {a.x / s, a.y / s, a.z / s};
}
template <class T>
LC_FN Vec3T<T>& operator+=(Vec3T<T>& a, Vec3T<T> b) {
  a = a + b;
  return a;
}
template <class T>
LC_FN Vec3T<T>& operator*=(Vec3T<T>& a, T s) {
  a = a * s;
  return a;
}
template <class T>
LC_FN bool operator==(Vec3T<T> a, Vec3T<T> b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}
template <class T>
LC_FN T dot(Vec3T<T> a, Vec3T<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
LC_FN Vec3T<T> cross(Vec3T<T> a, Vec3T<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
LC_FN T length_sq(Vec3T<T> a) {
  return dot(a, a);
}
template <class T>
LC_FN T length(Vec3T<T> a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}
/// Unit vector; the input must not be zero.
template <class T>
LC_FN Vec3T<T> normalize(Vec3T<T> a) {
  return a / length(a);
}
LC_FN float max_component(Vec3 a) { return max_of(a.x, max_of(a.y, a.z)); }
LC_FN float min_component(Vec3 a) { return min_of(a.x, min_of(a.y, a.z)); }
LC_FN Vec3 min_of(Vec3 a, Vec3 b) { return {min_of(a.x, b.x), min_of(a.y, b.y), min_of(a.z, b.z)}; }
LC_FN Vec3 max_of(Vec3 a, Vec3 b) { return {max_of(a.x, b.x), max_of(a.y, b.y), max_of(a.z, b.z)}; }
LC_FN float component(Vec3 a, int axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }

/// Relative luminance of linear sRGB (Rec. 709 primaries). Every decision of a cut is taken on it.
template <class T>
LC_FN T luminance(Vec3T<T> rgb) {
  return T(0.2126f) * rgb.x + T(0.7152f) * rgb.y + T(0.0722f) * rgb.z;
}

/// Axis-aligned box [m]; empty until something is added.
struct Box {
  Vec3 lo{kInfinity, kInfinity, kInfinity};
  Vec3 hi{-kInfinity, -kInfinity, -kInfinity};
};
LC_FN Box extend(Box b, Vec3 p) { return {min_of(b.lo, p), max_of(b.hi, p)}; }
LC_FN Box extend(Box a, Box b) { return {min_of(a.lo, b.lo), max_of(a.hi, b.hi)}; }
LC_FN bool is_empty(Box b) { return !(b.lo.x <= b.hi.x && b.lo.y <= b.hi.y && b.lo.z <= b.hi.z); }
LC_FN Vec3 center(Box b) { return (b.lo + b.hi) * 0.5f; }
/// Length of the box's diagonal [m]; 0 for an empty box.
LC_FN float diagonal(Box b) { return is_empty(b) ? 0.0f : length(b.hi - b.lo); }

/// Affine map, its columns being the images of the axes and of the origin: p -> x p.x + y p.y + z p.z + origin.
/// Spaces stand in the name of a variable: `world_from_object`.
struct Affine {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin{0, 0, 0};
};
LC_FN Vec3 transform_vector(const Affine& m, Vec3 v) { return m.x * v.x + m.y * v.y + m.z * v.z; }
LC_FN Vec3 transform_point(const Affine& m, Vec3 p) { return transform_vector(m, p) + m.origin; }
LC_FN Affine operator*(const Affine& a, const Affine& b) {
  return {transform_vector(a, b.x), transform_vector(a, b.y), transform_vector(a, b.z), transform_point(a, b.origin)};
}
/// Signed volume scale of the linear part; 0 where the map is singular, negative where it mirrors.
LC_FN float determinant(const Affine& m) { return dot(m.x, cross(m.y, m.z)); }
/// Image of a normal, not normalised, on the side that the map carries the front to (mirrors included).
/// Cofactor matrix times n: equals det * inverse-transpose * n, so it also holds for large and small scales.
LC_FN Vec3 transform_normal(const Affine& m, Vec3 n) {
  const Vec3 v = cross(m.y, m.z) * n.x + cross(m.z, m.x) * n.y + cross(m.x, m.y) * n.z;
  return determinant(m) < 0 ? -v : v;
}

/// True where every component is a finite number.
inline bool is_finite(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace lightcuts
