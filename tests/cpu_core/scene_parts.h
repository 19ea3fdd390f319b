#pragma once

#include <initializer_list>

#include "lightcuts/scene.h"

// Pieces to put test scenes together from.

namespace lightcuts::test {

inline std::uint32_t add_material(Scene& scene, Vec3 albedo, Vec3 emission = {0, 0, 0}, bool double_sided = false) {
  Material m;
  m.base_color = albedo;
  m.emission = emission;
  m.double_sided = double_sided;
  scene.materials.push_back(m);
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

inline std::uint32_t place(Scene& scene, Mesh mesh, const Affine& transform = {}) {
  scene.meshes.push_back(std::move(mesh));
  Instance instance;
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  instance.world_from_object = transform;
  scene.instances.push_back(instance);
  return instance.mesh;
}

/// Parallelogram with front side cross(e1, e2); texture coordinates run from 0 to 1 along both edges.
inline Mesh quad(Vec3 corner, Vec3 e1, Vec3 e2, std::uint32_t material) {
  Mesh mesh;
  mesh.positions = {corner, corner + e1, corner + e1 + e2, corner + e2};
  mesh.texcoords[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.material = material;
  return mesh;
}

/// Axis-aligned box from `lo` to `hi` whose fronts face outwards, or inwards.
inline Mesh box(Vec3 lo, Vec3 hi, std::uint32_t material, bool inwards = false) {
  Mesh mesh;
  mesh.material = material;
  for (int i = 0; i < 8; ++i) {
    mesh.positions.push_back({i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z});
  }
  const std::uint32_t faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : faces) {
    if (inwards) {
      mesh.triangles.push_back({f[0], f[2], f[1]});
      mesh.triangles.push_back({f[0], f[3], f[2]});
    } else {
      mesh.triangles.push_back({f[0], f[1], f[2]});
      mesh.triangles.push_back({f[0], f[2], f[3]});
    }
  }
  return mesh;
}

}  // namespace lightcuts::test
