#pragma once

#include "kernels/camera.h"
#include "kernels/offset_point.h"
#include "kernels/scene_view.h"
#include "kernels/texture.h"

namespace lightcuts {

/// What a ray sees of a triangle.
struct Surface {
  Vec3 position;  ///< [m], off the triangle to the side of `ng` by its rounding error: rays may start and end here
  Vec3 ng, ns;    ///< unit geometric and shading normal; both face the side the ray came from
  Vec3 albedo;    ///< [0, 1]
  Vec3 emission;  ///< radiance of that side [W/(m^2 sr)]
};

/// A triangle in the world.
struct TriangleGeometry {
  Vec3 p0, e1, e2;  ///< a corner and the edges to the other two [m]
  Vec3 front;       ///< unit normal of the front side
  float area;       ///< [m^2]
  float offset;     ///< larger than any rounding error of a point on it [m]
};

/// Bound of the terms that are added up in transform_point, whatever cancels.
LC_FN float transform_magnitude(const Affine& m, Vec3 p) {
  const Vec3 a = absolute(p);
  return max_component(absolute(m.x) * a.x + absolute(m.y) * a.y + absolute(m.z) * a.z + absolute(m.origin));
}

/// Where a ray to a point ends, as a share of the way: what the point lies on must not block it, and the rounding of a
/// long ray grows with its length. A blocker that is nearer to the point than 1e-5 of the distance is not seen.
inline constexpr float kShadowRayEnd = 1 - 1e-5f;

/// The ray that tells whether `to` is seen from `from`. Both are Surface::position, or moved off like it.
LC_FN Ray shadow_ray(Vec3 from, Vec3 to) { return {from, 0, to - from, kShadowRayEnd}; }

LC_KERNEL TriangleGeometry triangle_geometry(const SceneView& scene, std::uint32_t instance, std::uint32_t triangle) {
  const InstanceView& placed = scene.instances[instance];
  const MeshView& mesh = scene.meshes[placed.mesh];
  const std::uint32_t* corner = mesh.triangles[triangle];
  const Affine& m = placed.world_from_object;
  const Vec3 o0 = mesh.positions[corner[0]], o1 = mesh.positions[corner[1]], o2 = mesh.positions[corner[2]];
  TriangleGeometry g;
  g.p0 = transform_point(m, o0);
  g.e1 = transform_point(m, o1) - g.p0;
  g.e2 = transform_point(m, o2) - g.p0;
  // Scaled to unit size first: squares of tiny or huge areas would leave the range of float.
  const float size = max_of(max_component(absolute(g.e1)), max_component(absolute(g.e2)));
  const float scale = size > 0 ? 1 / size : 0.0f;
  const Vec3 n = cross(g.e1 * scale, g.e2 * scale);
  const float twice_area = length(n);
  g.area = 0.5f * twice_area * size * size;
  g.front = twice_area > 0 ? n / twice_area : Vec3{0, 0, 1};
  if (determinant(m) < 0) g.front = -g.front;
  g.offset =
      kSafeUlps * max_of(transform_magnitude(m, o0), max_of(transform_magnitude(m, o1), transform_magnitude(m, o2)));
  return g;
}

/// Point with barycentric weights (u, v), moved off the triangle to the side of unit normal `side`.
LC_KERNEL Vec3 point_on_triangle(const TriangleGeometry& g, float u, float v, Vec3 side) {
  return g.p0 + g.e1 * u + g.e2 * v + side * g.offset;
}

/// Interpolated texture coordinates of set 0 or 1; zero where the mesh has none.
LC_KERNEL Vec2 texcoord_at(const MeshView& mesh, const std::uint32_t* corner, std::uint8_t set, float u, float v) {
  const Vec2* t = mesh.texcoords[set];
  if (t == nullptr) return {0, 0};
  return t[corner[0]] * (1 - u - v) + t[corner[1]] * u + t[corner[2]] * v;
}

/// Interpolated vertex colour; white and opaque where the mesh has none.
LC_KERNEL Rgba vertex_color_at(const MeshView& mesh, const std::uint32_t* corner, float u, float v) {
  Rgba sum;
  if (mesh.colors == nullptr) return sum;
  const float weight[3] = {(1 - u - v) / 255, u / 255, v / 255};
  sum = {{0, 0, 0}, 0};
  for (int k = 0; k < 3; ++k) {
    const std::uint8_t* c = mesh.colors[corner[k]];
    sum.rgb += Vec3{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])} * weight[k];
    sum.alpha += static_cast<float>(c[3]) * weight[k];
  }
  return sum;
}

/// Colour and alpha of the base layer: factor times texture times vertex colour.
LC_KERNEL Rgba base_color_at(const SceneView& scene, const MeshView& mesh, std::uint32_t triangle, float u, float v) {
  const MaterialView& material = scene.materials[mesh.material];
  const std::uint32_t* corner = mesh.triangles[triangle];
  const Rgba vertex = vertex_color_at(mesh, corner, u, v);
  const TextureView& texture = material.base_color_texture;
  const Rgba texel = sample_texture(scene, texture, texcoord_at(mesh, corner, texture.texcoord, u, v));
  return {material.base_color * texel.rgb * vertex.rgb, material.alpha * texel.alpha * vertex.alpha};
}

/// True where an alpha mask cuts the triangle away: a ray goes on as if nothing were there.
LC_KERNEL bool cut_away(const SceneView& scene, const MeshView& mesh, std::uint32_t triangle, float u, float v) {
  const MaterialView& material = scene.materials[mesh.material];
  return material.masked && base_color_at(scene, mesh, triangle, u, v).alpha < material.alpha_cutoff;
}

/// Radiance that a point of the triangle emits on its emitting side(s); an alpha mask cuts it away too.
LC_KERNEL Vec3 emission_at(const SceneView& scene, const MeshView& mesh, std::uint32_t triangle, float u, float v) {
  const MaterialView& material = scene.materials[mesh.material];
  const TextureView& texture = material.emission_texture;
  if (texture.image == kNone) return material.emission;
  const Vec2 uv = texcoord_at(mesh, mesh.triangles[triangle], texture.texcoord, u, v);
  return material.emission * sample_texture(scene, texture, uv).rgb;
}

/// Shading normal on the side of `ng`; `ng` itself for flat meshes and where the interpolated one vanishes.
LC_KERNEL Vec3 shading_normal_at(const MeshView& mesh, const Affine& world_from_object, const std::uint32_t* corner,
                                 float u, float v, Vec3 ng) {
  if (mesh.normals == nullptr) return ng;
  const Vec3 n = mesh.normals[corner[0]] * (1 - u - v) + mesh.normals[corner[1]] * u + mesh.normals[corner[2]] * v;
  Vec3 world = transform_normal(world_from_object, n);
  // Cofactors of small scales may be tiny: bring to unit size before squaring.
  const float size = max_component(absolute(world));
  if (!(size > 0)) return ng;
  world = world / size;
  const float len = length(world);
  if (!(len > 0)) return ng;
  world = world / len;
  return dot(world, ng) < 0 ? -world : world;
}

/// The surface at a hit, seen by a ray of `ray_direction` (any length). The hit must be valid.
LC_KERNEL Surface surface_at(const SceneView& scene, const Hit& hit, Vec3 ray_direction) {
  const InstanceView& placed = scene.instances[hit.instance];
  const MeshView& mesh = scene.meshes[placed.mesh];
  const MaterialView& material = scene.materials[mesh.material];
  const std::uint32_t* corner = mesh.triangles[hit.triangle];
  const TriangleGeometry g = triangle_geometry(scene, hit.instance, hit.triangle);
  const bool from_front = dot(g.front, ray_direction) <= 0;
  Surface s;
  s.ng = from_front ? g.front : -g.front;
  s.position = point_on_triangle(g, hit.u, hit.v, s.ng);
  s.ns = shading_normal_at(mesh, placed.world_from_object, corner, hit.u, hit.v, s.ng);
  const Vec3 color = base_color_at(scene, mesh, hit.triangle, hit.u, hit.v).rgb;
  s.albedo = min_of(max_of(color, Vec3{0, 0, 0}), Vec3{1, 1, 1});
  s.emission = from_front || material.double_sided ? emission_at(scene, mesh, hit.triangle, hit.u, hit.v) : Vec3{};
  return s;
}

}  // namespace lightcuts
