#include "io/gltf_transform.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightcuts::gltf {
namespace {

using Vec3d = Vec3T<double>;

Vec3d apply(const Transform& m, Vec3d v) { return m.x * v.x + m.y * v.y + m.z * v.z; }

Vec3 narrow(Vec3d v) {
  const auto component = [](double value) {
    // Converting what no float can hold is undefined, so the result is named.
    constexpr double largest = std::numeric_limits<float>::max();
    if (std::abs(value) <= largest) return static_cast<float>(value);
    return std::isnan(value) ? std::numeric_limits<float>::quiet_NaN()
                             : std::copysign(std::numeric_limits<float>::infinity(), value > 0 ? 1.0f : -1.0f);
  };
  return {component(v.x), component(v.y), component(v.z)};
}

Transform read_matrix(const JsonValue& member) {
  std::array<float, 16> m{};
  member.numbers(m.data(), m.size());
  const auto column = [&](std::size_t i) { return Vec3d{m[4 * i], m[4 * i + 1], m[4 * i + 2]}; };
  return {column(0), column(1), column(2), column(3)};
}

bool usable(double length) { return std::isfinite(length) && length > 0; }

}  // namespace

Transform operator*(const Transform& a, const Transform& b) {
  return {apply(a, b.x), apply(a, b.y), apply(a, b.z), apply(a, b.origin) + a.origin};
}

Affine to_affine(const Transform& m) { return {narrow(m.x), narrow(m.y), narrow(m.z), narrow(m.origin)}; }

Transform make_transform(const float translation[3], const float rotation[4], const float scale[3]) {
  double q[4];
  double norm = 0;
  for (int i = 0; i < 4; ++i) norm += static_cast<double>(rotation[i]) * static_cast<double>(rotation[i]);
  norm = std::sqrt(norm);
  for (int i = 0; i < 4; ++i) q[i] = usable(norm) ? rotation[i] / norm : (i == 3 ? 1 : 0);
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  Transform m;
  m.x = Vec3d{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)} * static_cast<double>(scale[0]);
  m.y = Vec3d{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)} * static_cast<double>(scale[1]);
  m.z = Vec3d{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)} * static_cast<double>(scale[2]);
  m.origin = {translation[0], translation[1], translation[2]};
  return m;
}

Transform read_transform(const JsonValue& node) {
  if (const JsonValue matrix = node.find("matrix")) return read_matrix(matrix);
  std::array<float, 3> translation{0, 0, 0}, scale{1, 1, 1};
  std::array<float, 4> rotation{0, 0, 0, 1};
  if (const JsonValue member = node.find("translation")) member.numbers(translation.data(), translation.size());
  if (const JsonValue member = node.find("rotation")) member.numbers(rotation.data(), rotation.size());
  if (const JsonValue member = node.find("scale")) member.numbers(scale.data(), scale.size());
  return make_transform(translation.data(), rotation.data(), scale.data());
}

Affine without_scale(const Transform& m) {
  const double depth = length(m.z);
  const Vec3d z = usable(depth) ? m.z / depth : Vec3d{0, 0, 1};
  Vec3d x = cross(m.y, z);
  if (!usable(length(x))) x = cross(std::abs(z.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}, z);
  x = x / length(x);
  return to_affine({x, cross(z, x), z, m.origin});
}

}  // namespace lightcuts::gltf
