#include "cpu/ray_tracer.h"

#include <cstring>
#include <string>
#include <vector>

#include "cpu/embree.h"
#include "kernels/surface.h"
#include "kernels/triangle.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

/// From this many triangles on the hierarchy is built small rather than fast.
constexpr std::uint64_t kCompactFrom = 2'000'000;

/// What an alpha test needs of a geometry.
struct MaskedMesh {
  const SceneView* scene;
  std::uint32_t mesh;
};

/// Takes back the hits that an alpha mask cuts away. Serves packets of any width.
void alpha_filter(const RTCFilterFunctionNArguments* a) {
  const auto& masked = *static_cast<const MaskedMesh*>(a->geometryUserPtr);
  const MeshView& mesh = masked.scene->meshes[masked.mesh];
  for (unsigned int i = 0; i < a->N; ++i) {
    if (a->valid[i] == 0) continue;
    if (cut_away(*masked.scene, mesh, RTCHitN_primID(a->hit, a->N, i), RTCHitN_u(a->hit, a->N, i),
                 RTCHitN_v(a->hit, a->N, i))) {
      a->valid[i] = 0;
    }
  }
}

template <int N>
struct EmbreeRays;
template <>
struct EmbreeRays<4> {
  using type = RTCRay4;
};
template <>
struct EmbreeRays<8> {
  using type = RTCRay8;
};
template <>
struct EmbreeRays<16> {
  using type = RTCRay16;
};

template <int N, class Query>
std::uint32_t occluded_packet(const RayPacket<N>& rays, std::uint32_t active_mask, Query query) {
  using Rays = typename EmbreeRays<N>::type;
  alignas(64) int valid[N];
  Rays r;
  static_assert(sizeof(rays) == 8 * sizeof(r.tnear));
  // Up to tnear, and again direction, both lay their arrays out alike.
  std::memcpy(&r, &rays, 4 * sizeof(r.tnear));
  std::memcpy(r.dir_x, rays.dx, 3 * sizeof(r.tnear));
  std::memcpy(r.tfar, rays.t_max, sizeof(r.tfar));
  for (int i = 0; i < N; ++i) {
    valid[i] = (active_mask >> i & 1u) != 0 ? -1 : 0;
    r.time[i] = 0;
    r.mask[i] = 0xffffffffu;
    r.id[i] = 0;
    r.flags[i] = 0;
  }
  query(valid, &r);
  std::uint32_t blocked = 0;
  for (int i = 0; i < N; ++i) blocked |= (r.tfar[i] < 0 ? 1u : 0u) << i;  // Embree marks a blocked ray so
  return blocked & active_mask;
}

void fill(RTCRay& r, const Ray& ray) {
  r.org_x = ray.origin.x;
  r.org_y = ray.origin.y;
  r.org_z = ray.origin.z;
  r.tnear = ray.t_min;
  r.dir_x = ray.direction.x;
  r.dir_y = ray.direction.y;
  r.dir_z = ray.direction.z;
  r.time = 0;
  r.tfar = ray.t_max;
  r.mask = 0xffffffffu;
  r.id = 0;
  r.flags = 0;
}

/// Where on its triangle a ray hits, by the text that the GPU runs: Embree rounds otherwise, and on small triangles that shows in
/// interpolated normals, and so in what photons carry. What that text takes for a miss, at an edge, stays where Embree saw it.
Hit locate(const SceneView& scene, const Ray& ray, const Hit& seen) {
  const InstanceView& placed = scene.instances[seen.instance];
  const MeshView& mesh = scene.meshes[placed.mesh];
  const std::uint32_t* corner = mesh.triangles[seen.triangle];
  const auto at = [&](int k) { return transform_point(placed.world_from_object, mesh.positions[corner[k]]); };
  const TriangleHit hit =
      intersect_triangle(ray.origin, shear(ray.direction), at(0), at(1), at(2), ray.t_min, ray.t_max);
  return hit.t < 0 ? seen : Hit{hit.t, hit.u, hit.v, seen.instance, seen.triangle};
}

}  // namespace

/// Everything Embree holds for a scene.
struct RayTracer::Bvh {
  Bvh(const SceneView& view, std::uint64_t bake_below);
  ~Bvh();
  Bvh(const Bvh&) = delete;
  Bvh& operator=(const Bvh&) = delete;

  void build(std::uint64_t bake_below);
  void attach_mesh(RTCScene target, std::uint32_t mesh, const Affine& transform, std::uint32_t id);
  void attach_instance(std::uint32_t instance);
  RTCScene new_scene(std::uint64_t triangles);
  void release() const;
  void check() const;

  SceneView scene;
  RTCDevice device = nullptr;
  RTCScene top = nullptr;
  std::vector<RTCScene> mesh_scenes;      ///< of meshes that are instanced, else nullptr
  std::vector<MaskedMesh> masked_meshes;  ///< one a mesh: geometries point into it
};

RayTracer::Bvh::Bvh(const SceneView& view, std::uint64_t bake_below) : scene(view), device(rtcNewDevice(nullptr)) {
  if (device == nullptr) {
    throw Error(Code::out_of_memory, "Embree cannot start (error " + std::to_string(rtcGetDeviceError(nullptr)) +
                                         "): free some memory, or check that this processor has SSE2");
  }
  try {
    build(bake_below);
  } catch (...) {
    release();
    throw;
  }
}

RayTracer::Bvh::~Bvh() { release(); }

void RayTracer::Bvh::release() const {
  if (top != nullptr) rtcReleaseScene(top);
  for (RTCScene s : mesh_scenes) {
    if (s != nullptr) rtcReleaseScene(s);
  }
  rtcReleaseDevice(device);
}

void RayTracer::Bvh::check() const {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw Error(error == RTC_ERROR_OUT_OF_MEMORY ? Code::out_of_memory : Code::invalid_scene,
              error == RTC_ERROR_OUT_OF_MEMORY
                  ? std::string("not enough memory for the ray tracer's hierarchy: use a smaller scene or more memory")
                  : "Embree refused the scene (error " + std::to_string(error) + ")");
}

RTCScene RayTracer::Bvh::new_scene(std::uint64_t triangles) {
  RTCScene s = rtcNewScene(device);
  // Robust: no ray slips through between two triangles that share an edge.
  rtcSetSceneFlags(s,
                   triangles >= kCompactFrom ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_ROBUST);
  return s;
}

void RayTracer::Bvh::attach_mesh(RTCScene target, std::uint32_t mesh_index, const Affine& transform, std::uint32_t id) {
  const MeshView& mesh = scene.meshes[mesh_index];
  std::uint32_t vertex_count = 0;
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    for (const std::uint32_t corner : mesh.triangles[t]) vertex_count = max_of(vertex_count, corner + 1);
  }
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Vertices are copied even where the transform is the identity: Embree reads 16 bytes of each, so the last one of a
  // foreign array would be read past its end. Triangles are used in place.
  auto* vertices = static_cast<Vec3*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3), vertex_count));
  if (vertices == nullptr) {
    rtcReleaseGeometry(geometry);
    check();
    throw Error(Code::out_of_memory, "not enough memory for the ray tracer's vertices");
  }
  for (std::uint32_t v = 0; v < vertex_count; ++v) vertices[v] = transform_point(transform, mesh.positions[v]);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles, 0,
                             3 * sizeof(std::uint32_t), mesh.triangle_count);
  if (scene.materials[mesh.material].masked) {
    rtcSetGeometryUserData(geometry, &masked_meshes[mesh_index]);
    rtcSetGeometryIntersectFilterFunction(geometry, alpha_filter);
    rtcSetGeometryOccludedFilterFunction(geometry, alpha_filter);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(target, geometry, id);
  rtcReleaseGeometry(geometry);
}

void RayTracer::Bvh::attach_instance(std::uint32_t instance) {
  const InstanceView& placed = scene.instances[instance];
  RTCScene& mesh_scene = mesh_scenes[placed.mesh];
  if (mesh_scene == nullptr) {
    mesh_scene = new_scene(scene.meshes[placed.mesh].triangle_count);
    attach_mesh(mesh_scene, placed.mesh, Affine{}, 0);
    rtcCommitScene(mesh_scene);
    check();
  }
  static_assert(sizeof(Affine) == 12 * sizeof(float));
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, mesh_scene);
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &placed.world_from_object);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(top, geometry, instance);
  rtcReleaseGeometry(geometry);
}

void RayTracer::Bvh::build(std::uint64_t bake_below) {
  std::vector<std::uint32_t> uses(scene.mesh_count, 0);
  std::uint64_t drawn = 0;
  for (std::uint32_t i = 0; i < scene.instance_count; ++i) {
    ++uses[scene.instances[i].mesh];
    drawn += scene.meshes[scene.instances[i].mesh].triangle_count;
  }
  mesh_scenes.assign(scene.mesh_count, nullptr);
  for (std::uint32_t m = 0; m < scene.mesh_count; ++m) masked_meshes.push_back({&scene, m});
  top = new_scene(drawn);
  // A geometry's number is its instance's, so that hits need no table.
  for (std::uint32_t i = 0; i < scene.instance_count; ++i) {
    const InstanceView& placed = scene.instances[i];
    if (scene.meshes[placed.mesh].triangle_count == 0) continue;
    if (drawn < bake_below || uses[placed.mesh] == 1) {
      attach_mesh(top, placed.mesh, placed.world_from_object, i);
    } else {
      attach_instance(i);
    }
  }
  rtcCommitScene(top);
  check();
}

RayTracer::RayTracer(const SceneView& scene, std::uint64_t bake_below)
    : bvh_(std::make_unique<Bvh>(scene, bake_below)) {}
RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

Hit RayTracer::intersect(const Ray& ray) const {
  RTCRayHit r;
  fill(r.ray, ray);
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  embree::intersect1(bvh_->top, &r);
  if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const std::uint32_t instance = r.hit.instID[0] != RTC_INVALID_GEOMETRY_ID ? r.hit.instID[0] : r.hit.geomID;
  return locate(bvh_->scene, ray, {r.ray.tfar, r.hit.u, r.hit.v, instance, r.hit.primID});
}

bool RayTracer::occluded(const Ray& ray) const {
  RTCRay r;
  fill(r, ray);
  embree::occluded1(bvh_->top, &r);
  return r.tfar < 0;
}

std::uint32_t RayTracer::occluded4(const RayPacket4& rays, std::uint32_t active_mask) const {
  return occluded_packet(rays, active_mask, [&](const int* valid, RTCRay4* r) {
    embree::occluded4(valid, bvh_->top, r, embree::Coherence::coherent);
  });
}
std::uint32_t RayTracer::occluded8(const RayPacket8& rays, std::uint32_t active_mask) const {
  return occluded_packet(rays, active_mask, [&](const int* valid, RTCRay8* r) {
    embree::occluded8(valid, bvh_->top, r, embree::Coherence::coherent);
  });
}
std::uint32_t RayTracer::occluded16(const RayPacket16& rays, std::uint32_t active_mask) const {
  return occluded_packet(rays, active_mask, [&](const int* valid, RTCRay16* r) {
    embree::occluded16(valid, bvh_->top, r, embree::Coherence::coherent);
  });
}

}  // namespace lightcuts
