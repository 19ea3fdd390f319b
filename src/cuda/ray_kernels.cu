#include "cuda/ray_kernels.h"

#include "cuda/tracer.cuh"

namespace lightcuts::cuda {
namespace {

// Registers for so many blocks of a multiprocessor that waiting for memory hides best, by measurement.
constexpr int kRayThreads = 128, kNearestBlocks = 8, kAnyBlocks = 9;

__global__ void __launch_bounds__(kRayThreads, kNearestBlocks)
    nearest_kernel(DeviceTracer tracer, const Ray* rays, Hit* hits, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * kRayThreads + threadIdx.x;
  if (i < count) hits[i] = tracer.intersect(rays[i]);
}

__global__ void __launch_bounds__(kRayThreads, kAnyBlocks)
    any_kernel(DeviceTracer tracer, const Ray* rays, std::uint8_t* blocked, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * kRayThreads + threadIdx.x;
  if (i < count) blocked[i] = tracer.occluded(rays[i]) ? 1 : 0;
}

std::uint32_t blocks_for(std::uint32_t count) { return (count + kRayThreads - 1) / kRayThreads; }

}  // namespace

void trace_nearest(Device& device, const SceneView& scene, const WideBvhView& bvh, const Ray* rays, Hit* hits,
                   std::uint32_t count) {
  if (count == 0) return;
  nearest_kernel<<<blocks_for(count), kRayThreads, 0, device.stream()>>>({scene, bvh}, rays, hits, count);
  check(cudaGetLastError(), "tracing rays");
}

void trace_any(Device& device, const SceneView& scene, const WideBvhView& bvh, const Ray* rays, std::uint8_t* blocked,
               std::uint32_t count) {
  if (count == 0) return;
  any_kernel<<<blocks_for(count), kRayThreads, 0, device.stream()>>>({scene, bvh}, rays, blocked, count);
  check(cudaGetLastError(), "tracing shadow rays");
}

}  // namespace lightcuts::cuda
