#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "lightcuts/scene.h"

// An oracle for ray casting: every triangle of the scene, one after the other, in double precision. It shares nothing
// with the library but the Scene that both read.

namespace lightcuts::oracle {

struct D3 {
  double x = 0, y = 0, z = 0;
};
inline D3 operator-(D3 a, D3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline D3 operator+(D3 a, D3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline D3 operator*(D3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double inner(D3 a, D3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline D3 outer(D3 a, D3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline D3 wide(Vec3 v) { return {v.x, v.y, v.z}; }

inline D3 placed(const Affine& m, Vec3 p) {
  return wide(m.x) * double(p.x) + wide(m.y) * double(p.y) + wide(m.z) * double(p.z) + wide(m.origin);
}

struct Found {
  double t = std::numeric_limits<double>::infinity();
  double u = 0, v = 0;
  std::uint32_t instance = kNone, triangle = 0;
  double border = 1;  ///< how far inside the triangle: the smallest barycentric weight
};

/// Nearest texel with repeat, alpha only: what the masked test scenes use.
inline double nearest_alpha(const Scene& scene, const Mesh& mesh, const std::array<std::uint32_t, 3>& corner, double u,
                            double v) {
  const Material& material = scene.materials[mesh.material];
  if (!material.base_color_texture.present()) return material.alpha;
  const TextureImage& image = scene.images[material.base_color_texture.image];
  const auto& uv = mesh.texcoords[0];
  const double s = uv[corner[0]].x * (1 - u - v) + uv[corner[1]].x * u + uv[corner[2]].x * v;
  const double t = uv[corner[0]].y * (1 - u - v) + uv[corner[1]].y * u + uv[corner[2]].y * v;
  const auto x = static_cast<int>(std::floor((s - std::floor(s)) * image.width)) % image.width;
  const auto y = static_cast<int>(std::floor((t - std::floor(t)) * image.height)) % image.height;
  return material.alpha * image.texels[(std::size_t(y) * image.width + x) * image.channels + image.channels - 1] /
         255.0;
}

/// Where a line meets the plane of a triangle, by the corners' barycentric weights; `inside` where that is in it.
struct Meeting {
  double t = 0, u = 0, v = 0;
  bool inside = false;
};
inline Meeting meet(D3 origin, D3 direction, D3 p0, D3 p1, D3 p2) {
  const D3 e1 = p1 - p0, e2 = p2 - p0, p = outer(direction, e2);
  const double det = inner(e1, p);
  if (det == 0) return {};
  const D3 s = origin - p0, q = outer(s, e1);
  const double u = inner(s, p) / det, v = inner(direction, q) / det;
  return {inner(e2, q) / det, u, v, u >= 0 && v >= 0 && u + v <= 1};
}

/// The first triangle that a ray meets beyond t = 0.
inline Found intersect(const Scene& scene, Vec3 origin, Vec3 direction) {
  Found best;
  const D3 o = wide(origin), d = wide(direction);
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
    const Affine& m = scene.instances[i].world_from_object;
    for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
      const auto& corner = mesh.triangles[k];
      const auto [t, u, v, inside] = meet(o, d, placed(m, mesh.positions[corner[0]]),
                                          placed(m, mesh.positions[corner[1]]), placed(m, mesh.positions[corner[2]]));
      if (!inside || t <= 0 || t >= best.t) continue;
      const Material& material = scene.materials[mesh.material];
      if (material.alpha_mode == AlphaMode::mask && nearest_alpha(scene, mesh, corner, u, v) < material.alpha_cutoff) {
        continue;
      }
      best = {t, u, v, i, k, std::min({u, v, 1 - u - v})};
    }
  }
  return best;
}

}  // namespace lightcuts::oracle
