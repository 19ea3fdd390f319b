#include "io/obj_meshes.h"

#include <algorithm>
#include <cmath>

#include "io/obj_triple_map.h"

namespace lightcuts::obj {
namespace {

using Vec3d = Vec3T<double>;

Vec3d to_double(Vec3 v) { return {v.x, v.y, v.z}; }

/// Unit vector in double, zero where there is none: squares of float coordinates may be beyond a float.
Vec3d unit_or_zero(Vec3d v) {
  const double size = length(v);
  return size > 0 && std::isfinite(size) ? v / size : Vec3d{};
}

Vec3 to_float(Vec3d v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }

struct Triangle {
  std::array<Vec3d, 3> corner;
  Triangle(const Data& data, const Corner* corners) {
    for (std::size_t i = 0; i < 3; ++i) corner[i] = to_double(data.positions[corners[i].position]);
  }
  [[nodiscard]] Vec3d normal() const { return unit_or_zero(cross(corner[1] - corner[0], corner[2] - corner[0])); }
  [[nodiscard]] double angle(std::size_t i) const {
    const Vec3d a = unit_or_zero(corner[(i + 1) % 3] - corner[i]), b = unit_or_zero(corner[(i + 2) % 3] - corner[i]);
    return std::acos(std::clamp(dot(a, b), -1.0, 1.0));
  }
};

/// Gives corners of smoothing groups the mean normal of the group's faces around their position, weighted by the faces'
/// angles there: so that it does not depend on how polygons were cut. Source: Thuermer and Wuethrich 1998.
void compute_smooth_normals(Data& data) {
  TripleMap groups;
  std::vector<Vec3d> sums;
  for (Part& part : data.parts) {
    for (std::size_t t = 0; t + 2 < part.corners.size(); t += 3) {
      Corner* corners = &part.corners[t];
      if (std::none_of(corners, corners + 3, wants_smooth_normal)) continue;
      const Triangle triangle(data, corners);
      const Vec3d normal = triangle.normal();
      for (std::size_t i = 0; i < 3; ++i) {
        if (!wants_smooth_normal(corners[i])) continue;
        const std::uint32_t group = groups.insert({corners[i].position, corners[i].normal, 0});
        if (group == sums.size()) sums.emplace_back();
        const double angle = triangle.angle(i);
        if (std::isfinite(angle)) sums[group] += normal * angle;
        corners[i].normal = kSmoothBit | group;
      }
    }
  }
  // What has no mean (two faces back to back, or none with an area) stays flat.
  std::vector<std::uint32_t> index(sums.size(), kNone);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const Vec3d normal = unit_or_zero(sums[i]);
    if (length_sq(normal) == 0) continue;
    index[i] = static_cast<std::uint32_t>(data.normals.size());
    data.normals.push_back(to_float(normal));
  }
  for (Part& part : data.parts) {
    for (Corner& corner : part.corners) {
      if (wants_smooth_normal(corner)) corner.normal = index[corner.normal & ~kSmoothBit];
    }
  }
}

/// A mesh has normals everywhere or nowhere: beside smooth triangles, flat ones get their own.
void compute_flat_normals(Data& data, Part& part) {
  const auto is_flat = [](const Corner& corner) { return corner.normal == kNone; };
  if (std::all_of(part.corners.begin(), part.corners.end(), is_flat)) return;
  for (std::size_t t = 0; t + 2 < part.corners.size(); t += 3) {
    Corner* corners = &part.corners[t];
    if (std::none_of(corners, corners + 3, is_flat)) continue;
    const auto normal = static_cast<std::uint32_t>(data.normals.size());
    data.normals.push_back(to_float(Triangle(data, corners).normal()));
    for (std::size_t i = 0; i < 3; ++i) {
      if (is_flat(corners[i])) corners[i].normal = normal;
    }
  }
}

Mesh make_mesh(const Data& data, const Part& part) {
  Mesh mesh;
  mesh.name = part.name;
  mesh.material = part.material;

  TripleMap vertices;
  mesh.triangles.reserve(part.corners.size() / 3);
  for (std::size_t t = 0; t + 2 < part.corners.size(); t += 3) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
      const Corner& corner = part.corners[t + i];
      triangle[i] = vertices.insert({corner.position, corner.texcoord, corner.normal});
    }
    mesh.triangles.push_back(triangle);
  }

  const auto used = [&](std::size_t field) {
    return std::any_of(vertices.triples().begin(), vertices.triples().end(),
                       [&](const TripleMap::Triple& vertex) { return vertex[field] != kNone; });
  };
  const bool textured = used(1), smooth = used(2);
  mesh.positions.reserve(vertices.triples().size());
  for (const auto& [position, texcoord, normal] : vertices.triples()) {
    mesh.positions.push_back(data.positions[position]);
    if (textured) mesh.texcoords[0].push_back(texcoord == kNone ? Vec2{} : data.texcoords[texcoord]);
    if (smooth) mesh.normals.push_back(normal == kNone ? Vec3{} : data.normals[normal]);
    if (!data.colors.empty()) mesh.colors.push_back(data.colors[position]);
  }
  return mesh;
}

}  // namespace

void add_meshes(Data& data, Scene& scene) {
  compute_smooth_normals(data);
  for (Part& part : data.parts) {
    if (part.corners.empty()) continue;
    compute_flat_normals(data, part);
    scene.instances.push_back({part.name, static_cast<std::uint32_t>(scene.meshes.size()), {}});
    scene.meshes.push_back(make_mesh(data, part));
    part.corners = {};
  }
  data.parts.clear();
}

}  // namespace lightcuts::obj
