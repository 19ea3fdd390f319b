#include "scene/builtin/surface.h"

#include <cmath>

namespace lightcuts {
namespace {

/// Unit normals at both ends of every segment of a profile, averaged where the bend is gentle.
struct SegmentNormals {
  Vec2 start, end;
};

Vec2 unit(Vec2 v) {
  const float size = std::sqrt(v.x * v.x + v.y * v.y);
  return v * (1 / size);
}

std::vector<SegmentNormals> profile_normals(const std::vector<Vec2>& profile) {
  constexpr float kCosCrease = 0.766f;
  std::vector<SegmentNormals> normals(profile.size() - 1);
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const Vec2 along = profile[i + 1] - profile[i];
    normals[i].start = normals[i].end = unit({along.y, -along.x});
  }
  for (std::size_t i = 0; i + 1 < normals.size(); ++i) {
    const Vec2 a = normals[i].end, b = normals[i + 1].start;
    if (a.x * b.x + a.y * b.y > kCosCrease) normals[i].end = normals[i + 1].start = unit(a + b);
  }
  return normals;
}

}  // namespace

void add_lathe(Mesh& mesh, const std::vector<Vec2>& profile, int segments, Vec3 center) {
  const std::vector<SegmentNormals> normals = profile_normals(profile);
  const auto add_ring = [&](Vec2 point, Vec2 normal, float v) {
    for (int k = 0; k <= segments; ++k) {
      const float angle = 2 * kPi * static_cast<float>(k % segments) / static_cast<float>(segments);
      const float c = std::cos(angle), s = std::sin(angle);
      mesh.positions.push_back(center + Vec3{point.x * c, point.y, -point.x * s});
      mesh.normals.push_back({normal.x * c, normal.y, -normal.x * s});
      mesh.texcoords[0].push_back(
          {2 * kPi * std::fmax(point.x, 0.05f) * static_cast<float>(k) / static_cast<float>(segments), v});
    }
  };
  float v = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const auto row = static_cast<std::uint32_t>(segments + 1);
    const Vec2 along = profile[i + 1] - profile[i];
    const float next_v = v - std::sqrt(along.x * along.x + along.y * along.y);
    add_ring(profile[i], normals[i].start, v);
    add_ring(profile[i + 1], normals[i].end, next_v);
    v = next_v;
    for (std::uint32_t k = 0; k + 1 < row; ++k) {
      const std::uint32_t a = first + k, b = a + row;
      if (profile[i].x > 0) mesh.triangles.push_back({a, a + 1, b + 1});
      if (profile[i + 1].x > 0) mesh.triangles.push_back({a, b + 1, b});
    }
  }
}

}  // namespace lightcuts
