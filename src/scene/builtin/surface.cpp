#include "scene/builtin/surface.h"

#include <algorithm>
#include <array>
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
  segments = std::max(segments, 3);  // fewer enclose nothing
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

void add_ball(Mesh& mesh, Vec3 center, float radius, int segments) {
  std::vector<Vec2> profile;
  const int rings = segments / 2;
  for (int i = 0; i <= rings; ++i) {
    const float angle = kPi * (static_cast<float>(i) / static_cast<float>(rings) - 0.5f);
    profile.push_back({i == 0 || i == rings ? 0 : radius * std::cos(angle), radius * std::sin(angle)});
  }
  add_lathe(mesh, profile, segments, center);
}

void add_panel(Mesh& mesh, Vec3 corner, Vec3 along_u, Vec3 along_v) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const float u = length(along_u), v = length(along_v);
  const Vec3 normal = normalize(cross(along_u, along_v));
  mesh.positions.insert(mesh.positions.end(), {corner, corner + along_u, corner + along_u + along_v, corner + along_v});
  mesh.normals.insert(mesh.normals.end(), 4, normal);
  mesh.texcoords[0].insert(mesh.texcoords[0].end(), {{0, v}, {u, v}, {u, 0}, {0, 0}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

void add_sharp_box(Mesh& mesh, Box box) {
  const Vec3 size = box.hi - box.lo, x{size.x, 0, 0}, y{0, size.y, 0}, z{0, 0, size.z};
  add_panel(mesh, box.lo + z, x, y);
  add_panel(mesh, box.lo + x, -x, y);
  add_panel(mesh, box.lo + x + z, -z, y);
  add_panel(mesh, box.lo, z, y);
  add_panel(mesh, box.lo + y + z, x, -z);
  add_panel(mesh, box.lo, x, z);
}

void add_rounded_box(Mesh& mesh, Box box, float radius, int segments) {
  const Vec3 middle = center(box), half = (box.hi - box.lo) * 0.5f;
  const Vec3 core = half - Vec3{radius, radius, radius};

  // Each side is a grid of lines: those of one rounded edge, then those of the other.
  const int lines = 2 * (segments + 1);
  const auto slope = [&](int line) {
    const int step = line <= segments ? segments - line : line - segments - 1;
    const float angle = 0.25f * kPi * static_cast<float>(step) / static_cast<float>(segments);
    return line <= segments ? -std::tan(angle) : std::tan(angle);
  };
  const std::array<std::array<Vec3, 3>, 6> frames = {{{Vec3{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
                                                      {Vec3{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
                                                      {Vec3{0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
                                                      {Vec3{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
                                                      {Vec3{0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
                                                      {Vec3{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}}}};
  for (const auto& [out, along_u, along_v] : frames) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int j = 0; j < lines; ++j) {
      for (int i = 0; i < lines; ++i) {
        const float side_u = i <= segments ? -1.0f : 1.0f, side_v = j <= segments ? -1.0f : 1.0f;
        const Vec3 normal = normalize(out + along_u * slope(i) + along_v * slope(j));
        const Vec3 p = core * (out + along_u * side_u + along_v * side_v) + normal * radius;
        mesh.positions.push_back(middle + p);
        mesh.normals.push_back(normal);
        mesh.texcoords[0].push_back({dot(p, along_u), -dot(p, along_v)});
      }
    }
    for (int j = 0; j + 1 < lines; ++j) {
      for (int i = 0; i + 1 < lines; ++i) {
        const auto a = first + static_cast<std::uint32_t>(j * lines + i), b = a + static_cast<std::uint32_t>(lines);
        mesh.triangles.push_back({a, a + 1, b + 1});
        mesh.triangles.push_back({a, b + 1, b});
      }
    }
  }
}

void add_patch(Mesh& mesh, int nu, int nv, const std::function<Vec3(float, float)>& surface, Vec2 texture_size) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  constexpr float kStep = 1e-3f;
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i <= nu; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(nu),
                  v = static_cast<float>(j) / static_cast<float>(nv);
      const Vec3 along_u = surface(u + kStep, v) - surface(u - kStep, v);
      const Vec3 along_v = surface(u, v + kStep) - surface(u, v - kStep);
      mesh.positions.push_back(surface(u, v));
      mesh.normals.push_back(normalize(cross(along_u, along_v)));
      mesh.texcoords[0].push_back({u * texture_size.x, (1 - v) * texture_size.y});
    }
  }
  const auto row = static_cast<std::uint32_t>(nu + 1);
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(nv); ++j) {
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(nu); ++i) {
      const std::uint32_t a = first + j * row + i, b = a + row;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
}

void add_tube(Mesh& mesh, int nu, int nv, const std::function<Vec3(float)>& curve,
              const std::function<Vec2(float)>& radius, Vec3 binormal) {
  const auto surface = [&](float u, float v) {
    // Round the ends off; a fiftieth of the radius stays, because a triangle of a true pole would have no area.
    const float end = std::pow(std::fabs(2 * u - 1), 12.0f);
    const float cap = std::fmax(std::sqrt(std::fmax(1 - end, 0.0f)), 0.02f);
    const Vec3 tangent = normalize(curve(u + 1e-3f) - curve(u - 1e-3f));
    const Vec3 across = normalize(cross(binormal, tangent)), up = cross(tangent, across);
    const Vec2 r = radius(u) * cap;
    const float angle = 2 * kPi * v;
    return curve(u) + across * (r.x * std::cos(angle)) + up * (r.y * std::sin(angle));
  };
  add_patch(mesh, nv, nu, [&](float v, float u) { return surface(u, v); }, {0.2f, 1});
}

void append(Mesh& mesh, const Mesh& part, const Affine& mesh_from_part) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3 p : part.positions) mesh.positions.push_back(transform_point(mesh_from_part, p));
  for (const Vec3 n : part.normals) mesh.normals.push_back(normalize(transform_normal(mesh_from_part, n)));
  mesh.texcoords[0].insert(mesh.texcoords[0].end(), part.texcoords[0].begin(), part.texcoords[0].end());
  for (const auto& t : part.triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

Affine turned(float angle_deg, Vec3 origin) {
  const float angle = angle_deg * kPi / 180, c = std::cos(angle), s = std::sin(angle);
  return {{c, 0, -s}, {0, 1, 0}, {s, 0, c}, origin};
}

}  // namespace lightcuts
