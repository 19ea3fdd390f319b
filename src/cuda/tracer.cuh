#pragma once

#include "kernels/surface.h"
#include "kernels/wide_bvh.h"

namespace lightcuts::cuda {

/// Asks a material's alpha mask about a hit.
struct AlphaTest {
  SceneView scene;
  __device__ bool operator()(const LeafTriangle& triangle, const TriangleHit& hit) const {
    const MeshView& mesh = scene.meshes[scene.instances[triangle.instance].mesh];
    return !cut_away(scene, mesh, triangle.triangle, hit.u, hit.v);
  }
};

/// The ray tracer that shared kernels are given on the device.
struct DeviceTracer {
  SceneView scene;
  WideBvhView bvh;
  __device__ Hit intersect(const Ray& ray) const { return traverse<false>(bvh, ray, AlphaTest{scene}); }
  __device__ bool occluded(const Ray& ray) const { return traverse<true>(bvh, ray, AlphaTest{scene}).valid(); }
};

}  // namespace lightcuts::cuda
