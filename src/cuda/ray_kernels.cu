#include "cuda/ray_kernels.h"

#include "cuda/executor.cuh"
#include "cuda/tracer.cuh"

namespace lightcuts::cuda {
namespace {

struct NearestKernel {
  DeviceTracer tracer;
  const Ray* rays;
  Hit* hits;
  __device__ void operator()(std::uint32_t i) const { hits[i] = tracer.intersect(rays[i]); }
};

struct AnyKernel {
  DeviceTracer tracer;
  const Ray* rays;
  std::uint8_t* blocked;
  __device__ void operator()(std::uint32_t i) const { blocked[i] = tracer.occluded(rays[i]) ? 1 : 0; }
};

}  // namespace

void trace_nearest(Device& device, const SceneView& scene, const WideBvhView& bvh, const Ray* rays, Hit* hits,
                   std::uint32_t count) {
  CudaExecutor(device).for_each(count, NearestKernel{{scene, bvh}, rays, hits});
}

void trace_any(Device& device, const SceneView& scene, const WideBvhView& bvh, const Ray* rays, std::uint8_t* blocked,
               std::uint32_t count) {
  CudaExecutor(device).for_each(count, AnyKernel{{scene, bvh}, rays, blocked});
}

}  // namespace lightcuts::cuda
