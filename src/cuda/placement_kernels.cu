#include "cuda/placement_kernels.h"

#include "backend/vpl_placement.h"
#include "backend/vpl_plan.h"
#include "cuda/executor.cuh"
#include "cuda/tracer.cuh"
#include "kernels/placement.h"

namespace lightcuts::cuda {
namespace {

constexpr std::uint32_t kLanes = 32;
constexpr std::uint32_t kChunk = 64;  ///< lights that one thread adds up

/// All lights, VPLs first, then directional lights, then point lights, and the points that they are rated by.
struct Rated {
  DeviceTracer tracer;
  const PlacementPoint* points;
  std::uint32_t point_count;
  const Vpl* vpls;
  const DirectionalLight* directionals;
  const PointLight* punctual;
  std::uint32_t vpl_count, directional_count, punctual_count;
  float clamp_sq;

  __device__ float radiance(std::uint32_t light, std::uint32_t point) const {
    const PlacementPoint& p = points[point];
    if (light < vpl_count) {
      const Vpl vpl = vpls[light];
      return placement_radiance(p, vpl, vpl.intensity, clamp_sq, tracer);
    }
    light -= vpl_count;
    if (light < directional_count) {
      const DirectionalLight sun = directionals[light];
      return placement_radiance(p, sun, sun.irradiance, clamp_sq, tracer);
    }
    const PointLight lamp = punctual[light - directional_count];
    return placement_radiance(p, lamp, lamp.intensity, clamp_sq, tracer);
  }
};

struct TracePoints {
  DeviceTracer tracer;
  CameraView camera;
  PlacementGrid grid;
  std::uint64_t seed;
  PlacementPoint* points;
  __device__ void operator()(std::uint32_t i) const {
    points[i] = trace_placement_point(tracer.scene, tracer, camera, grid, i, seed);
  }
};

/// What some of the lights bring to a point. Neighbouring threads take neighbouring points: their rays stay together.
struct AddChunk {
  Rated rated;
  std::uint32_t samples;
  float* parts;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t point = i % rated.point_count, chunk = i / rated.point_count;
    const std::uint32_t last = min(samples, (chunk + 1) * kChunk);
    float sum = 0;
    for (std::uint32_t s = chunk * kChunk; s < last; ++s) sum += rated.radiance(s * kPlacementStride, point);
    parts[i] = sum;
  }
};

/// The worth of one light: a warp shares the points out among its lanes.
struct RateLights {
  Rated rated;
  const float* weights;
  std::uint32_t first;
  float* worth;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t light = first + i / kLanes, lane = i % kLanes;
    float squares = 0;
    for (std::uint32_t point = lane; point < rated.point_count; point += kLanes) {
      const float share = rated.radiance(light, point) * weights[point];
      squares += share * share;
    }
    for (std::uint32_t step = kLanes / 2; step > 0; step /= 2) {
      squares += __shfl_xor_sync(0xffffffffu, squares, static_cast<int>(step));
    }
    if (lane == 0) worth[light] = sqrtf(squares);
  }
};

std::vector<double> estimate_radiance(CudaExecutor& executor, const Rated& rated, std::uint32_t light_count) {
  const std::uint32_t samples = (light_count + kPlacementStride - 1) / kPlacementStride;
  const std::uint32_t chunks = (samples + kChunk - 1) / kChunk;
  DeviceBuffer<float> parts(executor.device(), std::size_t{chunks} * rated.point_count);
  executor.for_each(chunks * rated.point_count, AddChunk{rated, samples, parts.data()});
  std::vector<float> found(parts.size());
  parts.download(found.data(), found.size());
  std::vector<double> sum(rated.point_count, 0.0);
  for (std::size_t i = 0; i < found.size(); ++i) sum[i % rated.point_count] += double{found[i]} * kPlacementStride;
  return sum;
}

}  // namespace

std::vector<float> rate_for_camera(Device& device, const TracedScene& traced, const VplOptions& options,
                                   const DeviceLights& lights) {
  CudaExecutor executor(device);
  const PlacementView& view = *options.view;
  const PlacementGrid grid = make_placement_grid(view.width, view.height);
  const DeviceTracer tracer{traced.scene, traced.bvh};
  DeviceBuffer<PlacementPoint> points(device, std::size_t{grid.block_count()} * kPlacementBlock);
  executor.for_each(static_cast<std::uint32_t>(points.size()),
                    TracePoints{tracer, make_camera_view(view.camera, view.width, view.height), grid,
                                derive_seed(options.seed, placement_points), points.data()});
  std::vector<PlacementPoint> found(points.size());
  points.download(found.data(), found.size());

  const float clamp = placement_clamp(view.min_distance, traced.scene.diagonal);
  const Rated rated{tracer,
                    points.data(),
                    static_cast<std::uint32_t>(points.size()),
                    lights.vpls.data(),
                    lights.directionals.data(),
                    lights.points.data(),
                    lights.vpl_count,
                    lights.directional_count,
                    lights.point_count,
                    clamp * clamp};
  const std::vector<double> radiance =
      estimate_radiance(executor, rated, lights.vpl_count + lights.directional_count + lights.point_count);
  const DeviceBuffer<float> weights = [&] {
    const std::vector<float> values = placement_weights(found, radiance);
    DeviceBuffer<float> buffer = executor.upload(values.data(), values.size());
    device.synchronize();  // `values` ends here
    return buffer;
  }();

  const auto count = static_cast<std::uint32_t>(lights.vpl_count + lights.sky_count);
  DeviceBuffer<float> worth(device, count);
  // Some hundred million rays a launch: a launch must end in time for a GPU that also drives a display.
  constexpr std::uint32_t kBatch = 1u << 18;
  for (std::uint32_t first = 0; first < count; first += kBatch) {
    executor.for_each(std::min(kBatch, count - first) * kLanes, RateLights{rated, weights.data(), first, worth.data()});
  }
  std::vector<float> rates(count);
  worth.download(rates.data(), count);
  return rates;
}

}  // namespace lightcuts::cuda
