#pragma once

#include <array>

#include "lightcuts/scene.h"

namespace lightcuts {

/// Adds a rectangle with corner `p` and edges `a` and `b`; its front is on the side of cross(a, b).
inline void add_rectangle(Scene& scene, Vec3 p, Vec3 a, Vec3 b, std::uint32_t material) {
  Mesh mesh;
  mesh.positions = {p, p + a, p + a + b, p + b};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.material = material;
  scene.instances.push_back({"", static_cast<std::uint32_t>(scene.meshes.size()), {}});
  scene.meshes.push_back(mesh);
}

/// A closed room of 2 x 2 x 2 m around the origin, its fronts inside, all of material 0.
inline Scene closed_room(Vec3 albedo) {
  Scene scene;
  Material wall;
  wall.base_color = albedo;
  scene.materials.push_back(wall);
  add_rectangle(scene, {-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, 0);
  add_rectangle(scene, {-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, 0);
  add_rectangle(scene, {-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, 0);
  add_rectangle(scene, {1, -1, -1}, {0, 0, 2}, {0, 2, 0}, 0);
  add_rectangle(scene, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, 0);
  add_rectangle(scene, {-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, 0);
  return scene;
}

/// The closed room with a lamp of 0.8 x 0.8 m below its ceiling and a free-standing screen.
inline Scene lit_room() {
  Scene scene = closed_room({0.7f, 0.6f, 0.5f});
  Material lamp;
  lamp.base_color = {0.3f, 0.3f, 0.3f};
  lamp.emission = {5, 5, 4};
  scene.materials.push_back(lamp);
  add_rectangle(scene, {-0.4f, 0.99f, -0.4f}, {0.8f, 0, 0}, {0, 0, 0.8f}, 1);
  add_rectangle(scene, {-0.5f, -0.9f, -0.2f}, {0.8f, 0, 0.3f}, {0, 0.9f, 0}, 0);
  return scene;
}

inline Camera room_camera() { return look_at({0.1f, 0.05f, 0.95f}, {0, -0.1f, -1}, 1.7f); }

}  // namespace lightcuts
