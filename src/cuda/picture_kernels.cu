#include "cuda/executor.cuh"
#include "cuda/picture_kernels.h"
#include "cuda/tracer.cuh"
#include "kernels/camera_path.h"
#include "kernels/pixel_sample.h"

namespace lightcuts::cuda {
namespace {

struct TracePixels {
  DeviceTracer tracer;
  EmitterView emitters;
  PixelGrid grid;
  std::uint32_t sample;
  PixelView pixels;

  __device__ void operator()(std::uint32_t slot) const {
    const std::int32_t x = grid.x_of(slot), y = grid.y_of(slot);
    Surface s{};
    float depth = kInfinity;
    if (x < grid.width && y < grid.height) {
      const Vec2 at = sample_position(grid.seed, grid.width, x, y, sample, grid.centred);
      const Ray ray = camera_ray(grid.camera, at.x, at.y);
      const Hit hit = tracer.intersect(ray);
      if (hit.valid()) {
        s = surface_at(tracer.scene, hit, ray.direction);
        depth = hit.t * dot(ray.direction, grid.axis);
      } else if (emitters.environment_count > 0) {
        s.emission = eval_environment(emitters.environment, ray.direction);
      }
    }
    pixels.position[slot] = s.position;
    pixels.ns[slot] = s.ns;
    pixels.ng[slot] = s.ng;
    pixels.albedo[slot] = s.albedo;
    pixels.seen[slot] = s.emission;
    pixels.depth[slot] = depth;
  }
};

struct AddSample {
  PixelView pixels;
  const Vec3T<double>* light;
  FilmView film;

  __device__ void operator()(std::uint32_t slot) const {
    const Vec3 albedo = pixels.albedo[slot], seen = pixels.seen[slot];
    Vec3T<double> radiance{seen.x, seen.y, seen.z};
    if (light != nullptr) {
      const Vec3T<double> sum = light[slot];
      constexpr double inverse_pi = 0.31830988618379067154;
      radiance +=
          Vec3T<double>{albedo.x * inverse_pi * sum.x, albedo.y * inverse_pi * sum.y, albedo.z * inverse_pi * sum.z};
    }
    film.radiance[slot] += radiance;
    film.albedo[slot] += albedo;
    film.normal[slot] += pixels.ns[slot];
    if (pixels.depth[slot] < kInfinity) {
      film.depth[slot] += pixels.depth[slot];
      film.hits[slot] += 1;
    }
  }
};

struct TracePaths {
  DeviceTracer tracer;
  EmitterView emitters;
  PixelGrid grid;
  std::uint32_t first, last;
  int reflections;
  FilmView film;

  __device__ void operator()(std::uint32_t slot) const {
    const std::int32_t x = grid.x_of(slot), y = grid.y_of(slot);
    if (x >= grid.width || y >= grid.height) return;
    Vec3T<double> sum{};
    for (std::uint32_t sample = first; sample < last; ++sample) {
      const SampleStream stream = pixel_stream(grid.seed, grid.width, x, y, sample);
      const Vec2 inside = stream.draw(0).unit2(0);
      const Ray ray = camera_ray(grid.camera, static_cast<float>(x) + inside.x, static_cast<float>(y) + inside.y);
      const Vec3 radiance = estimate_radiance(tracer.scene, emitters, tracer, ray, stream, reflections);
      sum += Vec3T<double>{radiance.x, radiance.y, radiance.z};
    }
    film.radiance[slot] += sum;
  }
};

struct AddCutPlanes {
  CutPlanes sample;
  float* size_sum;
  float* bound_most;
  __device__ void operator()(std::uint32_t slot) const {
    size_sum[slot] += static_cast<float>(sample.size[slot]);
    bound_most[slot] = max_of(bound_most[slot], sample.bound[slot]);
  }
};

__device__ PictureTotals joined(const PictureTotals& a, const PictureTotals& b) {
  return {a.light + b.light,
          a.lost + b.lost,
          a.rays + b.rays,
          a.cuts + b.cuts,
          a.cut_nodes + b.cut_nodes,
          max_of(a.largest_cut, b.largest_cut),
          a.cuts_at_limit + b.cuts_at_limit};
}

constexpr std::uint32_t kTotalBlocks = 264;

/// A block sums every kTotalBlocks-th row of its size; its threads' sums are joined as a tree.
__global__ void __launch_bounds__(kBlockThreads)
    total_kernel(LitSample sample, std::uint32_t slots, PictureTotals* blocks) {
  __shared__ PictureTotals shared[kBlockThreads];
  PictureTotals sum;
  for (std::uint32_t slot = blockIdx.x * kBlockThreads + threadIdx.x; slot < slots;
       slot += kTotalBlocks * kBlockThreads) {
    const Vec3T<double> light = sample.light[slot];
    PictureTotals own;
    own.light = 0.2126 * light.x + 0.7152 * light.y + 0.0722 * light.z;
    own.lost = sample.lost[slot];
    own.rays = sample.rays[slot];
    if (sample.cut_size != nullptr && sample.cut_size[slot] > 0) {
      own.cuts = 1;
      own.cut_nodes = own.largest_cut = sample.cut_size[slot];
      own.cuts_at_limit = sample.cut_at_limit[slot];
    }
    sum = joined(sum, own);
  }
  shared[threadIdx.x] = sum;
  for (std::uint32_t half = kBlockThreads / 2; half > 0; half /= 2) {
    __syncthreads();
    if (threadIdx.x < half) shared[threadIdx.x] = joined(shared[threadIdx.x], shared[threadIdx.x + half]);
  }
  if (threadIdx.x == 0) blocks[blockIdx.x] = shared[0];
}

}  // namespace

PictureTotals sum_picture(Device& device, const PixelGrid& grid, const LitSample& sample) {
  DeviceBuffer<PictureTotals> blocks(device, kTotalBlocks);
  total_kernel<<<kTotalBlocks, kBlockThreads, 0, device.stream()>>>(sample, grid.slot_count(), blocks.data());
  check(cudaGetLastError(), "summing a picture");
  PictureTotals parts[kTotalBlocks], sum;
  blocks.download(parts, kTotalBlocks);
  for (const PictureTotals& part : parts) {
    sum.light += part.light;
    sum.lost += part.lost;
    sum.rays += part.rays;
    sum.cuts += part.cuts;
    sum.cut_nodes += part.cut_nodes;
    sum.largest_cut = max_of(sum.largest_cut, part.largest_cut);
    sum.cuts_at_limit += part.cuts_at_limit;
  }
  return sum;
}

void add_cut_planes(Device& device, const PixelGrid& grid, const CutPlanes& sample, float* size_sum,
                    float* bound_most) {
  CudaExecutor(device).for_each(grid.slot_count(), AddCutPlanes{sample, size_sum, bound_most});
}

PixelGrid make_pixel_grid(const Camera& camera, int width, int height, std::uint64_t seed, bool centred) {
  PixelGrid grid;
  grid.camera = make_camera_view(camera, width, height);
  grid.axis = normalize(transform_vector(camera.world_from_camera, Vec3{0, 0, -1}));
  grid.width = width;
  grid.height = height;
  grid.tiles_across = static_cast<std::uint32_t>((width + kTileWidth - 1) / kTileWidth);
  grid.tile_count = grid.tiles_across * static_cast<std::uint32_t>((height + kTileHeight - 1) / kTileHeight);
  grid.seed = seed;
  grid.centred = centred;
  return grid;
}

void trace_pixels(Device& device, const TracedScene& traced, const PixelGrid& grid, std::uint32_t sample,
                  const PixelView& pixels) {
  CudaExecutor(device).for_each(grid.slot_count(),
                                TracePixels{{traced.scene, traced.bvh}, traced.emitters, grid, sample, pixels});
}

void add_sample(Device& device, const PixelGrid& grid, const PixelView& pixels, const Vec3T<double>* light,
                const FilmView& film) {
  CudaExecutor(device).for_each(grid.slot_count(), AddSample{pixels, light, film});
}

void trace_paths(Device& device, const TracedScene& traced, const PixelGrid& grid, std::uint32_t first,
                 std::uint32_t last, int reflections, const FilmView& film) {
  CudaExecutor(device).for_each(
      grid.slot_count(), TracePaths{{traced.scene, traced.bvh}, traced.emitters, grid, first, last, reflections, film});
}

}  // namespace lightcuts::cuda
