#include "bench_frame/rays.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <vector>

#include "backend/scene_arrays.h"
#include "backend/surface_rays.h"
#include "cpu/ray_tracer.h"
#include "lightcuts/error.h"

#if defined(LIGHTCUTS_HAS_CUDA)
#include "cuda/device.h"
#include "cuda/device_scene.h"
#include "cuda/ray_kernels.h"
#endif

namespace lightcuts::app::frame {
namespace {

constexpr std::uint64_t kSeed = 5;

/// The times [ms] that `run` returns, without those of the warm-up.
template <class Run>
Repeats repeat(const IncoherentRays& rays, const Run& run) {
  std::vector<double> times;
  for (int k = -rays.warm_up; k < rays.runs; ++k) {
    const double ms = run();
    if (k >= 0) times.push_back(ms);
  }
  return summarise(times);
}

}  // namespace

Repeats time_on_cpu(int threads, const Scene& scene, const IncoherentRays& asked) {
  using Clock = std::chrono::steady_clock;
  const SceneArrays arrays(scene);
  const RayTracer tracer(arrays.view());
  const std::vector<Ray> rays = surface_rays(arrays.view(), asked.count, kSeed);
  std::vector<std::uint8_t> blocked(rays.size());
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  return repeat(asked, [&] {
    const auto start = Clock::now();
    arena.execute([&] {
      tbb::parallel_for(std::size_t{0}, rays.size(),
                        [&](std::size_t i) { blocked[i] = tracer.occluded(rays[i]) ? 1 : 0; });
    });
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  });
}

#if defined(LIGHTCUTS_HAS_CUDA)

Repeats time_on_gpu(int device_index, const Scene& scene, const IncoherentRays& asked) {
  cuda::Device device(device_index, 0);
  const SceneArrays arrays(scene);
  const cuda::DeviceScene on_device(device, scene, arrays.view());
  const std::vector<Ray> rays = surface_rays(arrays.view(), asked.count, kSeed);
  cuda::DeviceBuffer<Ray> device_rays(device, rays.size());
  device_rays.upload(rays.data(), rays.size());
  cuda::DeviceBuffer<std::uint8_t> blocked(device, rays.size());
  return repeat(asked, [&] {
    cuda::StageTimer timer(device, "incoherent rays");
    cuda::trace_any(device, on_device.view(), on_device.bvh(), device_rays.data(), blocked.data(), asked.count);
    return timer.ms();
  });
}

#else

Repeats time_on_gpu(int, const Scene&, const IncoherentRays&) {
  throw Error(Code::not_built, "this build has no CUDA backend");
}

#endif

}  // namespace lightcuts::app::frame
