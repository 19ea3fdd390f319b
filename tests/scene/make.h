#pragma once

#include "lightcuts/scene.h"

// Small scenes that the tests damage.

namespace lightcuts::test {

/// A unit square in the plane z = 0 that faces +z, drawn once, white, and shining.
inline Scene square_scene() {
  Scene scene;
  Material material;
  material.name = "paint";
  material.emission = {1, 1, 1};
  scene.materials.push_back(material);
  Mesh mesh;
  mesh.name = "square";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  mesh.texcoords[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back(mesh);
  scene.instances.push_back({"square", 0, {}});
  return scene;
}

inline float nan() { return std::numeric_limits<float>::quiet_NaN(); }
inline float infinity() { return std::numeric_limits<float>::infinity(); }

}  // namespace lightcuts::test
