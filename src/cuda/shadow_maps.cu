#include "cuda/shadow_maps.h"

#include <algorithm>

#include "cuda/executor.cuh"
#include "kernels/bits.h"
#include "kernels/draw_map.h"
#include "kernels/pull_push.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

constexpr int kWarp = 32;
constexpr std::uint32_t kAllLanes = 0xffffffffu;
/// Maps a launch: a launch must end in time for a GPU that also drives a display.
constexpr std::uint32_t kLaunchMaps = 1u << 16;
constexpr int kMostLevels = 11;

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

struct DrawParams {
  PointsView points;
  const MapRecord* records;
  const std::uint32_t* streams;
  void* codes;             ///< of the first map
  std::uint32_t* scratch;  ///< a part for each block, or null: shared memory serves
  std::uint32_t count;
  std::uint32_t scratch_words;  ///< a block's part
  int size, size_bits, levels;
  bool keeps_surfaces_apart;
  bool noise;
};

/// Texels of a row that a lane draws one after the other.
constexpr int kRun = 4;

/// What a disc may cover, cut into runs of up to kRun texels; numbers as floats, which are quicker than conversions.
struct alignas(16) RunBox {
  float lo_x, lo_y, end_x;
  float runs;  ///< in a row
  float inverse_runs;
  int begin;  ///< where the disc's runs begin among those of all
  int edge_count;
  float radius_sq;  ///< orthographic
};

/// Discs that a warp found in its points, side by side, so that its lanes can share out the runs of all of them.
struct alignas(16) WarpDiscs {
  float4 first[kWarp];   ///< of MapDisc the normal and the slack (orthographic: unit normal, plane)
  float4 second[kWarp];  ///< twice the centre (orthographic: once)
  RunBox box[kWarp];
  float4 edges[kWarp][5];  ///< those that come near; a fifth entry against bank conflicts
};

/// The lanes' numbers in a row: for each lane the last of the ascending `starts` that is not above its number.
__device__ int owner_of(int first, int start, int lane) {
  const bool within = start >= first && start < first + kWarp;
  const std::uint32_t own = within ? 1u << (start - first) : 0u;
#if __CUDA_ARCH__ >= 800
  const std::uint32_t marks = __reduce_or_sync(kAllLanes, own);
#else
  std::uint32_t marks = own;
  for (int step = 16; step > 0; step /= 2) marks |= __shfl_xor_sync(kAllLanes, marks, step);
#endif
  const int before = __popc(__ballot_sync(kAllLanes, start < first));
  return before + __popc(marks & (2u << lane) - 1u) - 1;
}

/// Runs that a disc's box is cut into.
__device__ int runs_of(const ProjectedDisc& disc) {
  return disc.empty() ? 0 : (disc.width() + kRun - 1) / kRun * (disc.rows.hi - disc.rows.lo + 1);
}

template <bool Paraboloid>
__device__ void stage_disc(const ProjectedDisc& disc, float radius_sq, int at, int begin, WarpDiscs& discs) {
  const Vec3 n = Paraboloid ? disc.disc.normal : disc.normal, c = Paraboloid ? disc.disc.twice_centre : disc.local;
  const auto runs = static_cast<float>((disc.width() + kRun - 1) / kRun);
  discs.first[at] = {n.x, n.y, n.z, Paraboloid ? disc.disc.slack : disc.plane};
  discs.second[at] = {c.x, c.y, c.z, 0};
  discs.box[at] = {static_cast<float>(disc.columns.lo),
                   static_cast<float>(disc.rows.lo),
                   static_cast<float>(disc.columns.hi + 1),
                   runs,
                   1 / runs,
                   begin,
                   0,
                   radius_sq};
}

/// Stages the edges of a cut disc that come near it.
template <bool Paraboloid>
__device__ void stage_edges(const MapView& view, const ProjectedDisc& disc, const DiscShape& shape, Vec3 centre, int at,
                            WarpDiscs& discs) {
  int count = 0;
  for (int i = 0; i < kDiscEdges; ++i) {
    const Vec3 world = shape.inward[i];
    if (dot(world, centre) - shape.offset[i] >= shape.radius) continue;
    const float offset = shape.offset[i] - dot(world, view.origin);
    Vec3 inward = to_local_vector(view.frame, world);
    if (Paraboloid) inward = map_edge(disc.disc, inward, offset);
    discs.edges[at][count++] = {inward.x, inward.y, inward.z, offset};
  }
  discs.box[at].edge_count = count;
}

/// Small whole numbers as floats and back, without the conversions, which GPUs do at a quarter of their speed.
__device__ float float_of_small(int i) {
  return __uint_as_float(0x4b000000u | static_cast<std::uint32_t>(i)) - 0x1p23f;
}
__device__ int small_of_float(float whole) { return static_cast<int>(__float_as_uint(whole + 0x1p23f) & 0x7fffffu); }
/// Also of numbers a little below 0, where steps would be halves beside 2^23.
__device__ float round_small(float v) { return (v + 0x1.8p23f) - 0x1.8p23f; }

/// What a texel that a disc covers is drawn with: larger is nearer, 0 is none. Of floats above 0 the bits are in order.
template <bool Paraboloid>
__device__ std::uint32_t nearness_at(const MapView& view, float4 first, float4 second, const float4* edges,
                                     int edge_count, float radius_sq, float u, float v) {
  if constexpr (Paraboloid) {
    const MapDisc<float> disc{{first.x, first.y, first.z}, {second.x, second.y, second.z}, first.w};
    const TexelRay<float> w = texel_ray(u, u * u, v, v * v);
    const DiscTest<float> test = test_disc(disc, w);
    if (!(test.nearness > 0) || !(test.outside < 0)) return 0;
    for (int e = 0; e < edge_count; ++e) {
      if (!(along(w, Vec3{edges[e].x, edges[e].y, edges[e].z}) > 0)) return 0;
    }
    return __float_as_uint(test.nearness);
  } else {
    const Vec3 hit = meet_plane_orthographic(u, v, Vec3{first.x, first.y, first.z}, first.w, view.half_width);
    if (!(hit.z > 0) || !(length_sq(hit - Vec3{second.x, second.y, second.z}) < radius_sq)) return 0;
    for (int e = 0; e < edge_count; ++e) {
      if (!(dot(Vec3{edges[e].x, edges[e].y, edges[e].z}, hit) > edges[e].w)) return 0;
    }
    return ~__float_as_uint(hit.z);
  }
}

/// Draws run `number` of all that the warp's discs may cover; disc `owner` has it.
template <bool Paraboloid>
__device__ void draw_run(const MapView& view, const WarpDiscs& discs, int owner, int number, float side, float texel,
                         std::uint32_t* nearness) {
  const RunBox box = discs.box[owner];
  const float inside = float_of_small(number - box.begin) + 0.5f;
  const float row = round_small(inside * box.inverse_runs - 0.5f);
  const float y = box.lo_y + row, x = box.lo_x + kRun * (inside - 0.5f - row * box.runs);
  const float v = y * texel + (0.5f * texel - 1);
  const float4 first = discs.first[owner], second = discs.second[owner];
  std::uint32_t* const at = nearness + small_of_float(y * side + x);
#pragma unroll
  for (int k = 0; k < kRun; ++k) {
    const float column = x + static_cast<float>(k);
    if (column >= box.end_x) break;
    const std::uint32_t found = nearness_at<Paraboloid>(view, first, second, discs.edges[owner], box.edge_count,
                                                        box.radius_sq, column * texel + (0.5f * texel - 1), v);
    if (found > at[k]) atomicMax(at + k, found);
  }
}

/// The depth code of a texel.
template <bool Paraboloid, class Depth>
__device__ Depth code_of(const MapView& view, float steps, std::uint32_t nearness, float u, float v) {
  if (nearness == 0) return kNoDepth<Depth>;
  if constexpr (!Paraboloid) return encode_depth<Depth>(__uint_as_float(~nearness), steps);
  const float rho_sq = u * u + v * v;
  if (!(rho_sq < view.rim_sq)) return kNoDepth<Depth>;
  return encode_depth<Depth>(depth_of_nearness(__uint_as_float(nearness), 1 + rho_sq), steps);
}

/// Draws the points of a warp's lanes, `index` kNone: none.
template <bool Paraboloid>
__device__ void draw_points(const DrawParams& p, const MapView& view, std::uint32_t index, int lane, WarpDiscs& discs,
                            std::uint32_t* nearness) {
  ProjectedDisc disc;
  Vec3 centre;
  int runs = 0;
  float radius = p.points.largest;
  std::uint32_t shape = 0;
  if (index != kNone) {
    const float4* const words = reinterpret_cast<const float4*>(p.points.points + index);
    const float4 a = __ldg(words);
    centre = {a.x, a.y, a.z};
    const Vec3 local = to_local_point(view, centre);
    if (map_sees<Paraboloid>(view, local, p.points.largest)) {
      const float4 b = __ldg(words + 1);
      shape = __float_as_uint(a.w);
      if (shape != 0) radius = __ldg(&p.points.shapes[shape].radius);
      disc = project_disc<Paraboloid>(view, local, Vec3{b.x, b.y, b.z}, radius, b.w, p.size);
      runs = runs_of(disc);
    }
  }
  int end = runs;
  for (int step = 1; step < kWarp; step *= 2) {
    const int other = __shfl_up_sync(kAllLanes, end, step);
    if (lane >= step) end += other;
  }
  const int total = __shfl_sync(kAllLanes, end, kWarp - 1);
  if (total == 0) return;
  const std::uint32_t has = __ballot_sync(kAllLanes, runs > 0);
  __syncwarp();
  if (runs > 0) {
    const int at = __popc(has & ((1u << lane) - 1u));
    stage_disc<Paraboloid>(disc, radius * radius, at, end - runs, discs);
    if (shape > 1) stage_edges<Paraboloid>(view, disc, p.points.shapes[shape], centre, at, discs);
  }
  __syncwarp();
  const int start = lane < __popc(has) ? discs.box[lane].begin : 0x7fffffff;
  const auto side = static_cast<float>(p.size);
  const float texel = 2.0f / side;
  for (int first = 0; first < total; first += kWarp) {
    const int owner = owner_of(first, start, lane);
    if (first + lane >= total) continue;
    draw_run<Paraboloid>(view, discs, owner, first + lane, side, texel, nearness);
  }
}

template <bool Paraboloid>
__device__ void draw_all_points(const DrawParams& p, const MapView& view, std::uint32_t stream, WarpDiscs& discs,
                                std::uint32_t* nearness) {
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const std::uint32_t first = threadIdx.x - static_cast<std::uint32_t>(lane);
  const std::uint32_t all = p.points.count, wanted = min(p.points.per_map, all);
  if (p.noise) {
    const double share = static_cast<double>(wanted) / static_cast<double>(all);
    for (std::uint32_t base = first; base < all; base += blockDim.x) {
      const std::uint32_t i = base + static_cast<std::uint32_t>(lane);
      const bool chosen = i < all && noise_chooses(i, stream, share);
      if (__ballot_sync(kAllLanes, chosen) == 0) continue;
      draw_points<Paraboloid>(p, view, chosen ? i : kNone, lane, discs, nearness);
    }
    return;
  }
  const std::uint32_t start = block_start(stream, all);
  for (std::uint32_t base = first; base < wanted; base += blockDim.x) {
    const std::uint32_t k = base + static_cast<std::uint32_t>(lane);
    std::uint32_t i = start + k;
    if (i >= all) i -= all;
    draw_points<Paraboloid>(p, view, k < wanted ? i : kNone, lane, discs, nearness);
  }
}

/// Turns what was drawn into depth codes, in place.
template <bool Paraboloid, class Depth>
__device__ void encode_map(const MapView& view, float steps, int size, int bits, std::uint32_t* codes) {
  const int texels = size * size;
  for (int i = static_cast<int>(threadIdx.x); i < texels; i += static_cast<int>(blockDim.x)) {
    codes[i] = code_of<Paraboloid, Depth>(view, steps, codes[i], texel_centre(i & (size - 1), size),
                                          texel_centre(i >> bits, size));
  }
}

// --- Filling holes ---

/// A level of a map's pyramid, 2^bits texels a side; whatever lies outside is empty.
template <class Depth, class Word>
struct Level {
  Word* codes;
  int bits;
  __device__ int size() const { return 1 << bits; }
  __device__ int count() const { return 1 << 2 * bits; }
  LC_KERNEL Depth operator()(int x, int y) const {
    const bool inside = static_cast<unsigned>(x | y) < 1u << bits;
    return inside ? static_cast<Depth>(codes[(y << bits) + x]) : kNoDepth<Depth>;
  }
};

template <class Depth, class Fine, class Coarse>
__device__ void pull_level(const Fine& fine, const Coarse& coarse, const FillRule& rule) {
  const int count = coarse.count();
  for (int i = static_cast<int>(threadIdx.x); i < count; i += static_cast<int>(blockDim.x)) {
    coarse.codes[i] = pull_at<Depth>(i & (coarse.size() - 1), i >> coarse.bits, rule, fine);
  }
  __syncthreads();
}

template <class Depth, class Coarse, class Fine>
__device__ void push_level(const Coarse& coarse, const Fine& fine, const FillRule& rule) {
  const int count = fine.count();
  for (int i = static_cast<int>(threadIdx.x); i < count; i += static_cast<int>(blockDim.x)) {
    if (static_cast<Depth>(fine.codes[i]) == kNoDepth<Depth>) {
      fine.codes[i] = push_at<Depth>(i & (fine.size() - 1), i >> fine.bits, rule, coarse);
    }
  }
  __syncthreads();
}

/// Fills the holes of the map in `codes` with the help of `coarser`, room for all its coarser levels.
template <class Depth>
__device__ void fill_map(std::uint32_t* codes, Depth* coarser, int bits, int levels, bool apart) {
  if (levels <= 0 || bits == 0) return;
  const Level<Depth, std::uint32_t> finest{codes, bits};
  const auto coarse_level = [&](int level) {
    Depth* at = coarser;
    for (int l = 1; l < level; ++l) at += 1 << 2 * (bits - l);
    return Level<Depth, Depth>{at, bits - level};
  };
  int deepest = 1;
  pull_level<Depth>(finest, coarse_level(1), fill_rule<Depth>(apart, 0));
  for (; deepest < levels && deepest < bits; ++deepest) {
    pull_level<Depth>(coarse_level(deepest), coarse_level(deepest + 1), fill_rule<Depth>(apart, deepest));
  }
  for (int level = deepest; level > 1; --level) {
    push_level<Depth>(coarse_level(level), coarse_level(level - 1), fill_rule<Depth>(apart, level - 1));
  }
  push_level<Depth>(coarse_level(1), finest, fill_rule<Depth>(apart, 0));
}

/// Writes the map, 4 bytes a thread at a time.
template <class Depth>
__device__ void write_map(const std::uint32_t* codes, std::size_t texels, Depth* out) {
  auto* const words = reinterpret_cast<std::uint32_t*>(out);
  if constexpr (sizeof(Depth) == 2) {
    for (std::size_t i = threadIdx.x; i < texels / 2; i += blockDim.x) {
      words[i] = codes[2 * i] | codes[2 * i + 1] << 16;
    }
  } else {
    for (std::size_t i = threadIdx.x; i < texels; i += blockDim.x) words[i] = codes[i];
  }
}

/// One block a map.
template <bool Paraboloid, class Depth>
__global__ void draw_maps_kernel(DrawParams p) {
  extern __shared__ uint4 shared[];
  auto* const discs = reinterpret_cast<WarpDiscs*>(shared);
  const std::size_t warps = blockDim.x / kWarp, texels = static_cast<std::size_t>(p.size) * p.size;
  auto* const in_shared = reinterpret_cast<std::uint32_t*>(discs + warps);
  std::uint32_t* const codes =
      p.scratch != nullptr ? p.scratch + static_cast<std::size_t>(blockIdx.x) * p.scratch_words : in_shared;
  auto* const coarser = reinterpret_cast<Depth*>(codes + texels);
  for (std::uint32_t map = blockIdx.x; map < p.count; map += gridDim.x) {
    const MapRecord record = p.records[map];
    const MapView view = view_of(record);
    for (std::size_t i = threadIdx.x; i < texels; i += blockDim.x) codes[i] = 0;
    __syncthreads();
    if (p.points.count > 0) {
      draw_all_points<Paraboloid>(p, view, p.streams[map], discs[threadIdx.x / kWarp], codes);
    }
    __syncthreads();
    encode_map<Paraboloid, Depth>(view, record.steps, p.size, p.size_bits, codes);
    __syncthreads();
    fill_map<Depth>(codes, coarser, p.size_bits, p.levels, p.keeps_surfaces_apart);
    write_map<Depth>(codes, texels, static_cast<Depth*>(p.codes) + map * texels);
    __syncthreads();
  }
}

// --- Launching ---

/// How a set's maps are drawn.
struct DrawPlan {
  int threads;
  bool in_shared;
  std::uint32_t blocks;  ///< where the scratch is in global memory; else one a map
  std::uint32_t shared_bytes, scratch_words;
};

int shared_memory_limit() {
  int device = 0, bytes = 0;
  check(cudaGetDevice(&device), "asking for the GPU");
  check(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device), "asking for shared memory");
  return bytes;
}

DrawPlan plan_drawing(const Device& device, const MapOptions& options) {
  const auto texels = static_cast<std::uint32_t>(options.size) * static_cast<std::uint32_t>(options.size);
  const std::uint32_t work = 4 * texels + (texels / 2) * static_cast<std::uint32_t>(options.depth_bits / 8);
  DrawPlan plan;
  plan.threads = options.threads > 0 ? options.threads : options.size >= 128 ? 256 : 128;
  const auto staging = static_cast<std::uint32_t>(plan.threads / kWarp * sizeof(WarpDiscs));
  plan.in_shared = staging + work <= static_cast<std::uint32_t>(shared_memory_limit());
  plan.shared_bytes = staging + (plan.in_shared ? work : 0);
  plan.scratch_words = plan.in_shared ? 0 : work / 4;
  plan.blocks = static_cast<std::uint32_t>(device.multiprocessors()) * (options.size <= 256 ? 4 : 1);
  return plan;
}

template <bool Paraboloid, class Depth>
void launch(Device& device, const DrawPlan& plan, const DrawParams& params) {
  const auto kernel = draw_maps_kernel<Paraboloid, Depth>;
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(plan.shared_bytes)),
        "setting up shared memory");
  const std::uint32_t blocks = plan.in_shared ? params.count : std::min(params.count, plan.blocks);
  kernel<<<blocks, plan.threads, plan.shared_bytes, device.stream()>>>(params);
  check(cudaGetLastError(), "drawing shadow maps");
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
    : device_(&device), options_(options), lights_(lights), capacity_(capacity) {
  slots_ = DeviceBuffer<std::uint32_t>(
      device, std::size_t{1} + lights.vpl_count + lights.point_count + lights.directional_count);
  records_ = DeviceBuffer<MapRecord>(device, capacity);
  streams_ = DeviceBuffer<std::uint32_t>(device, capacity);
  codes_ = DeviceBuffer<std::uint32_t>(device, capacity * (codes_per_map_bytes(options) / 4));
  const DrawPlan plan = plan_drawing(device, options);
  if (!plan.in_shared) {
    scratch_ = DeviceBuffer<std::uint32_t>(device, std::size_t{plan.scratch_words} * plan.blocks);
  }
  view_.vpl_slots = slots_.data();
  view_.point_slots = slots_.data() + lights.vpl_count;
  view_.directional_slots = slots_.data() + lights.vpl_count + lights.point_count;
  view_.records = records_.data();
  view_.codes = codes_.data();
  view_.size = options.size;
  view_.depth_bits = options.depth_bits;
  clear();
}

void DeviceMaps::clear() {
  slots_.fill_bytes(0xff);
  count_ = 0;
}

void DeviceMaps::draw(const PointsView& points, std::uint32_t first, std::uint32_t count, bool paraboloid) {
  const DrawPlan plan = plan_drawing(*device_, options_);
  for (std::uint32_t done = 0; done < count; done += kLaunchMaps) {
    DrawParams params;
    params.points = points;
    params.records = records_.data() + first + done;
    params.streams = streams_.data() + first + done;
    params.codes = codes_.data() + (std::size_t{first} + done) * (codes_per_map_bytes(options_) / 4);
    params.scratch = plan.in_shared ? nullptr : scratch_.data();
    params.count = std::min(kLaunchMaps, count - done);
    params.scratch_words = plan.scratch_words;
    params.size = options_.size;
    params.size_bits = highest_bit(static_cast<std::uint32_t>(options_.size));
    params.levels = std::min(options_.levels, kMostLevels);
    params.keeps_surfaces_apart = options_.fill == HoleFill::edges;
    params.noise = options_.choice == PointChoice::noise;
    if (options_.depth_bits == 16) {
      paraboloid ? launch<true, std::uint16_t>(*device_, plan, params)
                 : launch<false, std::uint16_t>(*device_, plan, params);
    } else {
      paraboloid ? launch<true, std::uint32_t>(*device_, plan, params)
                 : launch<false, std::uint32_t>(*device_, plan, params);
    }
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
