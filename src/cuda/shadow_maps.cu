#include "cuda/shadow_maps.h"

#include <algorithm>
#include <type_traits>

#include "cuda/executor.cuh"
#include "cuda/map_drawing.cuh"
#include "cuda/map_filling.cuh"
#include "kernels/bits.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

/// Maps a launch: a launch must end in time for a GPU that also drives a display.
constexpr std::uint32_t kLaunchMaps = 1u << 16;
constexpr int kMostLevels = 11;
constexpr int kMostThreads = 256;   ///< that draw a map
constexpr int kSmallMapBlocks = 9;  ///< a multiprocessor, measured: fewer registers, but more at work

// --- What a light's map is made of ---

struct VplSource {
  const Vpl* lights;
  Box bounds;
  static constexpr std::uint32_t kind = 0;
  static constexpr bool paraboloid = true;
  __device__ std::uint32_t maps(std::uint32_t) const { return 1; }
  __device__ MapView view(std::uint32_t light, int) const {
    return vpl_map_view(lights[light].position, lights[light].axis, bounds);
  }
};

struct PointSource {
  const PointLight* lights;
  Box bounds;
  int size;
  static constexpr std::uint32_t kind = 1;
  static constexpr bool paraboloid = true;
  __device__ std::uint32_t maps(std::uint32_t light) const {
    return static_cast<std::uint32_t>(point_map_count(lights[light].cos_outer));
  }
  __device__ MapView view(std::uint32_t light, int which) const {
    return point_map_view(lights[light].position, lights[light].axis, bounds, size, which);
  }
};

struct DirectionalSource {
  const DirectionalLight* lights;
  Box bounds;
  static constexpr std::uint32_t kind = 2;
  static constexpr bool paraboloid = false;
  __device__ std::uint32_t maps(std::uint32_t) const { return 1; }
  __device__ MapView view(std::uint32_t light, int) const { return orthographic_view(lights[light].direction, bounds); }
};

template <class Source>
struct CountMaps {
  Source source;
  LightRange range;
  std::uint32_t* counts;
  __device__ void operator()(std::uint32_t i) const {
    counts[i] = source.maps(range.ids != nullptr ? range.ids[i] : range.first + i);
  }
};

/// Writes the records of the lights' maps; `before` null: one map each.
template <class Source>
struct WriteRecords {
  Source source;
  LightRange range;
  const std::uint32_t* before;
  std::uint32_t first_slot, seed;
  int size, depth_bits;
  std::uint32_t* slots;
  MapRecord* records;
  std::uint32_t* streams;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t light = range.ids != nullptr ? range.ids[i] : range.first + i;
    const std::uint32_t slot = first_slot + (before != nullptr ? before[i] : i);
    slots[light] = slot;
    for (std::uint32_t which = 0; which < source.maps(light); ++which) {
      const MapView view = source.view(light, static_cast<int>(which));
      records[slot + which] =
          depth_bits == 16 ? make_map_record<std::uint16_t>(view, size) : make_map_record<std::uint32_t>(view, size);
      streams[slot + which] = map_stream(light, Source::kind, seed);
    }
  }
};

// --- Drawing ---

/// Turns a map of kSmallMap texels a side into codes, fills its holes and writes it.
template <bool Paraboloid>
__device__ void finish_small_map(const MapView& view, float steps, const int* nearness, SmallPyramid& pyramid,
                                 bool apart, std::uint16_t* out) {
  const int x = static_cast<int>(threadIdx.x % 8) * 4, y = static_cast<int>(threadIdx.x / 8) * 2;
  std::uint16_t fine[2][4];
#pragma unroll
  for (int j = 0; j < 2; ++j) {
    const int4 drawn = *reinterpret_cast<const int4*>(nearness + (y + j) * kSmallMap + x);
    const int row[4] = {drawn.x, drawn.y, drawn.z, drawn.w};
#pragma unroll
    for (int i = 0; i < 4; ++i) {
      fine[j][i] = code_of<Paraboloid, std::uint16_t>(view, steps, row[i], texel_centre(x + i, kSmallMap),
                                                      texel_centre(y + j, kSmallMap));
    }
  }
  fill_small_map(fine, pyramid, apart);
  write_small_map(fine, out);
}

/// One block a map. `Size` and `Threads`: those of the maps made most often, so that the loops over texels unroll; 0:
/// as the launch says. `InShared`: the map is drawn in shared memory, else in the block's scratch.
template <bool Paraboloid, class Depth, bool InShared, int Size, int Threads, int Blocks = 1>
__global__ void __launch_bounds__(Threads > 0 ? Threads : 256, Blocks) draw_maps_kernel(DrawParams p) {
  using Queue = DiscQueue<std::conditional_t<InShared, std::uint32_t, std::uint64_t>>;
  extern __shared__ uint4 shared[];
  const int size = Size > 0 ? Size : p.size,
            bits = Size > 0 ? highest_bit(static_cast<std::uint32_t>(Size)) : p.size_bits;
  const int threads = Threads > 0 ? Threads : static_cast<int>(blockDim.x);
  auto& queue = *reinterpret_cast<Queue*>(shared);
  const std::uint32_t texels = 1u << 2 * bits;
  const std::uint32_t codes_at = (Size > 0 ? sizeof(Queue) : p.codes_at) / sizeof(uint4);
  std::uint32_t* const codes = InShared ? reinterpret_cast<std::uint32_t*>(shared + codes_at)
                                        : p.scratch + static_cast<std::size_t>(blockIdx.x) * p.scratch_words;
  for (std::uint32_t map = blockIdx.x; map < p.count; map += gridDim.x) {
    const MapRecord record = p.records[map];
    const MapView view = view_of(record);
    auto* const words = reinterpret_cast<uint4*>(codes);
#pragma unroll 2
    for (std::uint32_t i = threadIdx.x; i < texels / 4; i += static_cast<std::uint32_t>(threads)) words[i] = {};
    auto* const nearness = reinterpret_cast<int*>(codes);
    if (p.points.count > 0) {
      using Texels = std::conditional_t<InShared, SharedTexels, GlobalTexels>;
      draw_all_points<Paraboloid>(p, view, size, bits, threads, p.streams[map], queue, Texels(nearness));
    } else {
      __syncthreads();
    }
    // The queue's memory serves the coarser levels.
    Depth* const out = static_cast<Depth*>(p.codes) + static_cast<std::size_t>(map) * texels;
    if constexpr (Size == kSmallMap && Threads == kSmallMapThreads && sizeof(Depth) == 2) {
      if (p.levels == 2) {
        finish_small_map<Paraboloid>(view, record.steps, nearness, *reinterpret_cast<SmallPyramid*>(shared),
                                     p.keeps_surfaces_apart, out);
        __syncthreads();
        continue;
      }
    }
    encode_map<Paraboloid, Depth>(view, record.steps, size, bits, threads, codes);
    __syncthreads();
    fill_map<Depth>(codes, InShared ? reinterpret_cast<Depth*>(shared) : reinterpret_cast<Depth*>(codes + texels), bits,
                    p.levels, p.keeps_surfaces_apart, threads);
    write_map<Depth>(codes, texels, out, static_cast<std::uint32_t>(threads));
    __syncthreads();
  }
}

// --- Launching ---

/// How a set's maps are drawn.
struct DrawPlan {
  int threads;
  bool in_shared;
  std::uint32_t blocks;  ///< where the scratch is in global memory; else one a map
  std::uint32_t shared_bytes, codes_at, scratch_words;
};

int shared_memory_limit() {
  int device = 0, bytes = 0;
  check(cudaGetDevice(&device), "asking for the GPU");
  check(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device), "asking for shared memory");
  return bytes;
}

DrawPlan plan_drawing(const Device& device, const MapOptions& options) {
  const auto texels = static_cast<std::uint32_t>(options.size) * static_cast<std::uint32_t>(options.size);
  const std::uint32_t queue = sizeof(DiscQueue<std::uint32_t>), large_queue = sizeof(DiscQueue<std::uint64_t>);
  const std::uint32_t coarser = (texels / 2) * static_cast<std::uint32_t>(options.depth_bits / 8);
  DrawPlan plan;
  plan.threads = options.threads > 0 ? std::min(options.threads, kMostThreads) : options.size >= 128 ? 256 : 128;
  plan.codes_at = (std::max(queue, coarser) + 15) / 16 * 16;
  plan.in_shared = plan.codes_at + 4 * texels <= static_cast<std::uint32_t>(shared_memory_limit());
  plan.shared_bytes = plan.in_shared ? plan.codes_at + 4 * texels : large_queue;
  plan.scratch_words = plan.in_shared ? 0 : texels + coarser / 4;
  plan.blocks = static_cast<std::uint32_t>(device.multiprocessors()) * (options.size <= 256 ? 4 : 1);
  return plan;
}

using DrawMaps = void (*)(DrawParams);

template <bool Paraboloid, class Depth>
DrawMaps kernel_for(const DrawPlan& plan, int size) {
  if constexpr (Paraboloid && sizeof(Depth) == 2) {
    if (plan.in_shared && size == kSmallMap && plan.threads == kSmallMapThreads) {
      return draw_maps_kernel<true, Depth, true, kSmallMap, kSmallMapThreads, kSmallMapBlocks>;
    }
  }
  return plan.in_shared ? draw_maps_kernel<Paraboloid, Depth, true, 0, 0>
                        : draw_maps_kernel<Paraboloid, Depth, false, 0, 0>;
}

DrawMaps kernel_for(const DrawPlan& plan, const MapOptions& options, bool paraboloid) {
  if (options.depth_bits == 16) {
    return paraboloid ? kernel_for<true, std::uint16_t>(plan, options.size)
                      : kernel_for<false, std::uint16_t>(plan, options.size);
  }
  return paraboloid ? kernel_for<true, std::uint32_t>(plan, options.size)
                    : kernel_for<false, std::uint32_t>(plan, options.size);
}

}  // namespace

MapOptions map_options(const ShadeOptions& options) {
  return {options.ism_size,
          options.ism_depth_bits,
          options.ism_levels,
          options.ism_fill,
          options.ism_choice,
          options.seed,
          0};
}

std::uint64_t DeviceMaps::codes_per_map_bytes(const MapOptions& options) {
  return static_cast<std::uint64_t>(options.size) * static_cast<std::uint64_t>(options.size) *
         static_cast<std::uint64_t>(options.depth_bits / 8);
}

std::uint64_t DeviceMaps::bytes_per_map(const MapOptions& options) {
  return codes_per_map_bytes(options) + sizeof(MapRecord) + sizeof(std::uint32_t);
}

std::uint64_t DeviceMaps::fixed_bytes(const Device& device, const MapOptions& options, const LightArrays& lights) {
  const std::uint64_t count = std::uint64_t{lights.vpl_count} + lights.point_count + lights.directional_count;
  const DrawPlan plan = plan_drawing(device, options);
  // Point lights are counted in two more arrays and a prefix sum.
  return 4 * count + 12 * std::uint64_t{lights.point_count} + (1u << 20) +
         std::uint64_t{4} * plan.scratch_words * plan.blocks;
}

DeviceMaps::DeviceMaps(Device& device, const MapOptions& options, const LightArrays& lights, std::uint32_t capacity)
    : device_(&device), options_(options), lights_(lights) {
  slots_ = DeviceBuffer<std::uint32_t>(
      device, std::size_t{1} + lights.vpl_count + lights.point_count + lights.directional_count);
  grow(capacity);
  const DrawPlan plan = plan_drawing(device, options);
  if (!plan.in_shared) {
    scratch_ = DeviceBuffer<std::uint32_t>(device, std::size_t{plan.scratch_words} * plan.blocks);
  }
  view_.vpl_slots = slots_.data();
  view_.point_slots = slots_.data() + lights.vpl_count;
  view_.directional_slots = slots_.data() + lights.vpl_count + lights.point_count;
  view_.size = options.size;
  view_.depth_bits = options.depth_bits;
  clear();
}

namespace {

/// A larger buffer with the first `count` values of another, which it takes the place of.
template <class T>
void enlarge(Device& device, DeviceBuffer<T>& buffer, std::size_t size, std::size_t count) {
  DeviceBuffer<T> larger(device, size);
  if (count > 0) {
    check(cudaMemcpyAsync(larger.data(), buffer.data(), count * sizeof(T), cudaMemcpyDeviceToDevice, device.stream()),
          "copying shadow maps");
  }
  buffer = std::move(larger);
}

}  // namespace

void DeviceMaps::grow(std::uint32_t capacity) {
  const std::size_t words = codes_per_map_bytes(options_) / 4;
  enlarge(*device_, records_, capacity, count_);
  view_.records = records_.data();
  enlarge(*device_, streams_, capacity, count_);
  enlarge(*device_, codes_, capacity * words, count_ * words);
  view_.codes = codes_.data();
  capacity_ = capacity;
}

namespace {

__device__ bool same_place(const Vpl& a, const Vpl& b) { return a.position == b.position && a.axis == b.axis; }
__device__ bool same_place(const PointLight& a, const PointLight& b) {
  return a.position == b.position && a.axis == b.axis && a.cos_outer == b.cos_outer;
}
__device__ bool same_place(const DirectionalLight& a, const DirectionalLight& b) { return a.direction == b.direction; }

/// Places that the maps of a light take.
__device__ std::uint32_t places_of(const PointLight& light) { return light.cos_outer < 0 ? 2 : 1; }
template <class Light>
__device__ std::uint32_t places_of(const Light&) {
  return 1;
}

template <class Light>
struct ForgetMoved {
  const Light* before;
  const Light* now;
  std::uint32_t* slots;
  std::uint32_t* forgotten;
  __device__ void operator()(std::uint32_t i) const {
    if (slots[i] == kNone || same_place(before[i], now[i])) return;
    slots[i] = kNone;
    atomicAdd(forgotten, places_of(before[i]));
  }
};

}  // namespace

std::uint32_t DeviceMaps::replace_lights(const LightArrays& lights) {
  CudaExecutor executor(*device_);
  DeviceBuffer<std::uint32_t> count(*device_, 1);
  count.fill_bytes(0);
  std::uint32_t* const slots = slots_.data();
  executor.for_each(lights.vpl_count, ForgetMoved<Vpl>{lights_.vpls, lights.vpls, slots, count.data()});
  executor.for_each(lights.point_count,
                    ForgetMoved<PointLight>{lights_.points, lights.points, slots + lights.vpl_count, count.data()});
  executor.for_each(lights.directional_count,
                    ForgetMoved<DirectionalLight>{lights_.directionals, lights.directionals,
                                                  slots + lights.vpl_count + lights.point_count, count.data()});
  lights_ = lights;
  std::uint32_t forgotten = 0;
  count.download(&forgotten, 1);
  device_->synchronize();
  return forgotten;
}

void DeviceMaps::renew(std::uint32_t capacity) {
  clear();
  codes_ = {};
  capacity_ = 0;  // should the next line throw
  grow(capacity);
}

void DeviceMaps::clear() {
  slots_.fill_bytes(0xff);
  count_ = 0;
}

void DeviceMaps::draw(const PointsView& points, std::uint32_t first, std::uint32_t count, bool paraboloid) {
  const DrawPlan plan = plan_drawing(*device_, options_);
  const DrawMaps kernel = kernel_for(plan, options_, paraboloid);
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(plan.shared_bytes)),
        "setting up shared memory");
  for (std::uint32_t done = 0; done < count; done += kLaunchMaps) {
    DrawParams params;
    params.points = points;
    params.records = records_.data() + first + done;
    params.streams = streams_.data() + first + done;
    params.codes = codes_.data() + (std::size_t{first} + done) * (codes_per_map_bytes(options_) / 4);
    params.scratch = plan.in_shared ? nullptr : scratch_.data();
    params.count = std::min(kLaunchMaps, count - done);
    params.scratch_words = plan.scratch_words;
    params.codes_at = plan.codes_at;
    params.size = options_.size;
    params.size_bits = highest_bit(static_cast<std::uint32_t>(options_.size));
    params.levels = std::min(options_.levels, kMostLevels);
    params.keeps_surfaces_apart = options_.fill == HoleFill::edges;
    params.noise = options_.choice == PointChoice::noise;
    params.share = static_cast<double>(std::min(points.per_map, points.count)) / std::max(1u, points.count);
    const std::uint32_t blocks = plan.in_shared ? params.count : std::min(params.count, plan.blocks);
    kernel<<<blocks, plan.threads, plan.shared_bytes, device_->stream()>>>(params);
    check(cudaGetLastError(), "drawing shadow maps");
  }
}

template <class Source>
void DeviceMaps::add(const PointsView& points, const LightRange& range, const Source& source) {
  if (range.count == 0) return;
  CudaExecutor executor(*device_);
  std::uint32_t maps = range.count;
  DeviceBuffer<std::uint32_t> counts, before;
  if constexpr (Source::kind == 1) {
    counts = DeviceBuffer<std::uint32_t>(*device_, range.count);
    before = DeviceBuffer<std::uint32_t>(*device_, range.count);
    executor.for_each(range.count, CountMaps<Source>{source, range, counts.data()});
    maps = executor.exclusive_scan(counts.data(), before.data(), range.count);
  }
  if (maps > capacity_ - count_) {
    throw Error(Code::out_of_memory, "there is no room for the shadow maps of a batch; give a larger --memory");
  }
  const std::uint32_t* const slots[3] = {view_.vpl_slots, view_.point_slots, view_.directional_slots};
  executor.for_each(range.count,
                    WriteRecords<Source>{source, range, before.data(), count_, map_seed(options_.seed), options_.size,
                                         options_.depth_bits, slots_.data() + (slots[Source::kind] - slots_.data()),
                                         records_.data(), streams_.data()});
  draw(points, count_, maps, Source::paraboloid);
  count_ += maps;
}

void DeviceMaps::add_vpls(const PointsView& points, const LightRange& range) {
  add(points, range, VplSource{lights_.vpls, points.bounds});
}

void DeviceMaps::add_points(const PointsView& points, const LightRange& range) {
  add(points, range, PointSource{lights_.points, points.bounds, options_.size});
}

void DeviceMaps::add_directionals(const PointsView& points, const LightRange& range) {
  add(points, range, DirectionalSource{lights_.directionals, points.bounds});
}

}  // namespace lightcuts::cuda
