#include "cuda/tree_rounds.cuh"

#include <cstddef>

#include "cuda/warp.cuh"

// How a pass of merging is one launch without waits: a block takes a tile (backend/light_tree_tiles.h), keeps its clusters
// in shared memory, in the order of the curve and without gaps, and merges them round by round.

namespace lightcuts::cuda {
namespace {

using namespace lightcuts::detail;

constexpr int kWarp = 32;
constexpr int kPlacing = 256;  ///< threads of a block that places nodes

// --- Clusters in shared memory ---

/// What pairs need, by place in the array; the rest stays where it is, in the slot of the lower part's.
template <int Size>
struct TileMemory {
  static constexpr int kChunks = Size / kWarp;

  float4 low[Size];   ///< the box's lower corner, luminance
  float4 high[Size];  ///< the upper one, cosine of the cone's half angle
  float4 cone[Size];  ///< its axis, sine of the half angle
  /// Ranks of the best pair with a cluster further up, and with one further down.
  std::uint32_t up[Size], down[Size];
  std::int16_t offset[Size];  ///< of the best partner
  std::uint16_t slot[Size];
  std::uint32_t stay[kChunks], merge[kChunks];  ///< a bit a place

  // By slot.
  float4 light[Size];  ///< intensity, representative
  float4 rest[Size];   ///< what is left of the intensity, leaves
  uint4 making[Size];  ///< smallest light, largest light, height, id
  std::uint32_t name[Size];

  std::uint32_t begin[kTilesJoined + 1];  ///< of the joined tiles' clusters
};

template <int Size>
__device__ void put_sized(TileMemory<Size>& m, int at, const SizedCluster& c) {
  const Vec3 &l = c.cluster.box.lo, &h = c.cluster.box.hi, &a = c.cluster.cone.axis;
  m.low[at] = {l.x, l.y, l.z, c.cluster.luminance};
  m.high[at] = {h.x, h.y, h.z, c.cluster.cone.cos_half_angle};
  m.cone[at] = {a.x, a.y, a.z, c.sine};
}

/// `Colored`: with what metrics of colour ask for.
template <bool Colored, int Size>
__device__ SizedCluster get_sized(const TileMemory<Size>& m, int at) {
  const float4 low = m.low[at], high = m.high[at], cone = m.cone[at];
  SizedCluster c;
  c.cluster.box = {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
  c.cluster.cone = {{cone.x, cone.y, cone.z}, high.w};
  c.cluster.luminance = low.w;
  c.sine = cone.w;
  if constexpr (Colored) {
    const float4 light = m.light[m.slot[at]];
    c.cluster.intensity = {light.x, light.y, light.z};
    c.cluster.color = chromaticity(c.cluster.intensity);
  }
  return c;
}

template <int Size>
__device__ void put_sums(TileMemory<Size>& m, int slot, const Vec3& intensity, std::uint32_t representative,
                         std::uint32_t leaf_count, const NodeMaking& making, std::uint32_t id) {
  m.light[slot] = {intensity.x, intensity.y, intensity.z, __uint_as_float(representative)};
  m.rest[slot] = {making.rest.x, making.rest.y, making.rest.z, __uint_as_float(leaf_count)};
  m.making[slot] = {making.smallest_light, making.largest_light, making.height, id};
}

struct Shape {
  Box box;
  DirectionCone cone;
};
/// By the numbers: luminances, beside them, may just be written.
template <int Size>
__device__ Shape get_shape(const TileMemory<Size>& m, int at) {
  const float4 &low = m.low[at], &high = m.high[at], &cone = m.cone[at];
  return {{{low.x, low.y, low.z}, {high.x, high.y, high.z}}, {{cone.x, cone.y, cone.z}, high.w}};
}

struct Sums {
  LightNode node;  ///< in part
  NodeMaking making;
  std::uint32_t id;
};
template <int Size>
__device__ Sums get_sums(const TileMemory<Size>& m, int slot) {
  const float4 light = m.light[slot], rest = m.rest[slot];
  const uint4 making = m.making[slot];
  Sums sums;
  sums.node.intensity = {light.x, light.y, light.z};
  sums.node.representative = __float_as_uint(light.w);
  sums.node.leaf_count = __float_as_uint(rest.w);
  sums.making = {{rest.x, rest.y, rest.z}, making.x, making.y, making.z};
  sums.id = making.w;
  return sums;
}

// --- A tile ---

template <int Size>
__device__ void load_cluster(const NodesMaking& making, TileMemory<Size>& m, int at, LiveCluster of,
                             const LightNode& node) {
  put_sized(m, at, sized(making.cluster(node)));
  put_sums(m, at, node.intensity, node.representative, node.leaf_count, making.making_of(of.id, node), of.id);
  m.name[at] = of.name;
  m.slot[at] = static_cast<std::uint16_t>(at);
  m.up[at] = m.down[at] = __float_as_uint(kInfinity);
}

// Ways to load a tile; they return how many clusters it has.

/// Leaves that are there.
struct LoadLeaves {
  template <int Threads, int Size>
  __device__ int load(const TilePass& p, TileMemory<Size>& m) const {
    const std::uint32_t begin = blockIdx.x * kLeafTile, live = min(kLeafTile, p.count - begin);
    for (std::uint32_t i = threadIdx.x; i < live; i += Threads) {
      const LightNode node = p.making.nodes[begin + i];
      load_cluster(p.making, m, static_cast<int>(i), {begin + i, begin + i}, node);
    }
    __syncthreads();
    return static_cast<int>(live);
  }
};

/// Leaves that are made.
template <class Light>
struct LoadLights {
  MakeLeaves<Light> make;

  template <int Threads, int Size>
  __device__ int load(const TilePass& p, TileMemory<Size>& m) const {
    const std::uint32_t begin = blockIdx.x * kLeafTile, live = min(kLeafTile, p.count - begin);
    for (std::uint32_t i = threadIdx.x; i < live; i += Threads) {
      const LightNode node = make.leaf(begin + i);
      p.making.nodes[begin + i] = node;
      load_cluster(p.making, m, static_cast<int>(i), {begin + i, begin + i}, node);
    }
    __syncthreads();
    return static_cast<int>(live);
  }
};

/// What tiles of the pass before left.
struct LoadTiles {
  template <int Threads, int Size>
  __device__ int load(const TilePass& p, TileMemory<Size>& m) const {
    static_assert(kTilesJoined == kWarp);
    const std::uint32_t first = blockIdx.x * kTilesJoined, joined = min(kTilesJoined, p.count - first);
    const int t = static_cast<int>(threadIdx.x);
    if (t < kWarp) {
      std::uint32_t sum = threadIdx.x < joined ? p.from_counts[first + threadIdx.x] : 0;
      for (int step = 1; step < kWarp; step *= 2) {
        const std::uint32_t before = __shfl_up_sync(kAllLanes, sum, step);
        if (t >= step) sum += before;
      }
      if (t == 0) m.begin[0] = 0;
      m.begin[t + 1] = sum;
    }
    __syncthreads();
    for (std::uint32_t i = threadIdx.x; i < joined * kTileLeaves; i += Threads) {
      const std::uint32_t of = i / kTileLeaves, at = m.begin[of] + i % kTileLeaves;
      if (at >= m.begin[of + 1]) continue;
      const LiveCluster cluster = p.from[first * kTileLeaves + i];
      const LightNode node = p.making.nodes[cluster.id];
      load_cluster(p.making, m, static_cast<int>(at), cluster, node);
    }
    __syncthreads();
    return static_cast<int>(m.begin[kTilesJoined]);
  }
};

/// Ranks all pairs. Where there are threads enough, several share the pairs of a cluster with those further up.
template <bool Colored, int Threads, int Size>
__device__ void rank_pairs(const MetricScale& scale, int live, int radius, TileMemory<Size>& m) {
  const int bits = live <= kWarp ? 5 : 32 - __clz(live - 1), ways = max(1, Threads >> bits);
  for (int item = static_cast<int>(threadIdx.x); item < ways << bits; item += Threads) {
    const int i = item & ((1 << bits) - 1), first = 1 + (item >> bits);
    if (i >= live) continue;
    const SizedCluster own = get_sized<Colored>(m, i);
    const int reach = min(radius, live - 1 - i);
    std::uint32_t up = __float_as_uint(kInfinity);
    for (int offset = first; offset <= reach; offset += ways) {
      const float size = pair_size(own, get_sized<Colored>(m, i + offset), scale);
      const std::uint32_t rank =
          __float_as_uint(ploc_rank(size, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(offset)));
      up = min(up, rank);
      atomicMin(m.down + i + offset, rank);
    }
    if (ways == 1) {
      m.up[i] = up;
    } else {
      atomicMin(m.up + i, up);
    }
  }
  __syncthreads();
}

/// Finds each cluster's partner, and marks who merges and who stays.
template <int Threads, int Size>
__device__ void choose_partners(int live, int reluctance, TileMemory<Size>& m) {
  const int t = static_cast<int>(threadIdx.x);
  for (int i = t; i < live; i += Threads) {
    m.offset[i] = static_cast<std::int16_t>(
        ploc_offset(__uint_as_float(m.up[i]), __uint_as_float(m.down[i]), static_cast<std::uint32_t>(i)));
  }
  __syncthreads();
  if (reluctance > 0) {
    for (int i = 2 * t; i + 1 < live; i += 2 * Threads) pair_neighbours(m.offset + i, reluctance > 1);
    __syncthreads();
  }
  for (int i = t; i < (live + kWarp - 1) / kWarp * kWarp; i += Threads) {
    const int offset = i < live ? m.offset[i] : 0;
    const bool pairs = i < live && m.offset[i + offset] == -offset, merges = pairs && offset > 0;
    const std::uint32_t merge = __ballot_sync(kAllLanes, merges);
    const std::uint32_t stay = __ballot_sync(kAllLanes, i < live && (!pairs || merges));
    if (t % kWarp == 0) {
      m.merge[i / kWarp] = merge;
      m.stay[i / kWarp] = stay;
    }
  }
  __syncthreads();
}

/// Place of the n-th bit that is set.
__device__ int place_of_bit(std::uint32_t bits, int n) {
  int place = 0;
#pragma unroll
  for (int width = 16; width > 0; width /= 2) {
    const int below = __popc(bits & ((1u << width) - 1));
    if (n >= below) {
      n -= below;
      bits >>= width;
      place += width;
    }
  }
  return place;
}

// The cluster at place i and its partner become one, which lies at place i and in its slot until gaps are closed. Two
// threads can share the work.

template <int Size>
__device__ void merge_shapes_at(const NodesMaking& making, int i, TileMemory<Size>& m) {
  const int j = i + m.offset[i];
  const Shape p = get_shape(m, i), q = get_shape(m, j);
  const MergedShape merged = NodesMaking::merge_shapes(p.box, p.cone, q.box, q.cone);
  making.put(making.leaf_count - 1 + m.name[m.slot[j]], merged);
  const Vec3 &l = merged.box.lo, &h = merged.box.hi, &a = merged.cone.axis;
  float4& low = m.low[i];
  low.x = l.x, low.y = l.y, low.z = l.z;
  m.high[i] = {h.x, h.y, h.z, merged.cone.cos_half_angle};
  m.cone[i] = {a.x, a.y, a.z, lightcuts::detail::sine_of(merged.cone.cos_half_angle)};
}

template <int Size>
__device__ void merge_sums_at(const NodesMaking& making, int i, TileMemory<Size>& m) {
  const int slot = m.slot[i], other = m.slot[i + m.offset[i]];
  const Sums p = get_sums(m, slot), q = get_sums(m, other);
  const MergedSums merged = making.merge_sums(p.id, p.node, p.making, q.id, q.node, q.making);
  const std::uint32_t id = making.leaf_count - 1 + m.name[other];
  making.put(id, merged);
  put_sums(m, slot, merged.intensity, merged.representative, merged.leaf_count, merged.making, id);
  m.low[i].w = making.luminance_of(merged.intensity);
}

/// Merges the pairs and closes the gaps; returns how many clusters are left.
template <int Threads, bool Shared, int Size>
__device__ int merge_pairs(const NodesMaking& making, int live, TileMemory<Size>& m) {
  constexpr int kChunks = TileMemory<Size>::kChunks;
  const int t = static_cast<int>(threadIdx.x), lane = t % kWarp;
  // Sums over the chunks up to this lane's: those that stay in the low half, merges in the high one.
  std::uint32_t sum = lane * kWarp < live ? __popc(m.stay[lane]) | __popc(m.merge[lane]) << 16 : 0;
  for (int step = 1; step < kChunks; step *= 2) {
    const std::uint32_t before = __shfl_up_sync(kAllLanes, sum, step);
    if (lane >= step) sum += before;
  }
  const std::uint32_t total = __shfl_sync(kAllLanes, sum, kChunks - 1);
  const int merges = static_cast<int>(total >> 16);
  // With threads to spare, half of them merge shapes and the other half sums: either takes long.
  constexpr int kMerging = Shared ? Threads / 2 : Threads;
  const bool shapes = !Shared || t < kMerging, sums = !Shared || !shapes;
  for (int first = 0; first < merges; first += kMerging) {
    const int k = first + t % kMerging;
    int chunk = 0, before = 0;
#pragma unroll
    for (int c = 0; c < kChunks - 1; ++c) {
      const int up_to = static_cast<int>(__shfl_sync(kAllLanes, sum, c) >> 16);
      if (k >= up_to) {
        chunk = c + 1;
        before = up_to;
      }
    }
    if (k >= merges) continue;
    const int i = chunk * kWarp + place_of_bit(m.merge[chunk], k - before);
    if (shapes) merge_shapes_at(making, i, m);
    if (sums) merge_sums_at(making, i, m);
  }
  __syncthreads();

  constexpr int kEach = (Size + Threads - 1) / Threads;
  float4 low[kEach], high[kEach], cone[kEach];
  std::uint16_t slot[kEach];
  int next[kEach];
#pragma unroll
  for (int e = 0; e < kEach; ++e) {
    const int i = e * Threads + t, chunk = i / kWarp;
    next[e] = -1;
    if (chunk * kWarp >= live) continue;
    const std::uint32_t before = __shfl_sync(kAllLanes, sum, max(chunk - 1, 0) % kWarp) & 0xffffu;
    if ((m.stay[chunk] >> lane & 1u) == 0) continue;
    next[e] = static_cast<int>(chunk == 0 ? 0 : before) + __popc(m.stay[chunk] & ((1u << lane) - 1));
    low[e] = m.low[i];
    high[e] = m.high[i];
    cone[e] = m.cone[i];
    slot[e] = m.slot[i];
  }
  __syncthreads();
#pragma unroll
  for (int e = 0; e < kEach; ++e) {
    if (next[e] < 0) continue;
    m.low[next[e]] = low[e];
    m.high[next[e]] = high[e];
    m.cone[next[e]] = cone[e];
    m.slot[next[e]] = slot[e];
    m.up[next[e]] = m.down[next[e]] = __float_as_uint(kInfinity);
  }
  __syncthreads();
  return static_cast<int>(total & 0xffffu);
}

template <bool Colored, int Size, int Threads, int Blocks, bool Shared, class Load>
__global__ void __launch_bounds__(Threads, Blocks) merge_tiles_kernel(TilePass p, Load loads) {
  extern __shared__ float4 shared[];
  auto& m = *reinterpret_cast<TileMemory<Size>*>(shared);
  int live = loads.template load<Threads>(p, m);
  const int goal = static_cast<int>(p.goal());
  int reluctance = 0;
  while (live > goal) {
    const bool all = live <= static_cast<int>(kSearchAllBelow);
    rank_pairs<Colored, Threads>(p.making.scale, live, static_cast<int>(all ? kLargestPlocRadius : p.radius), m);
    choose_partners<Threads>(live, reluctance, m);
    const int left = merge_pairs<Threads, Shared>(p.making, live, m);
    reluctance =
        reluctance_after(reluctance, static_cast<std::uint32_t>(live), static_cast<std::uint32_t>(live - left));
    live = left;
  }
  const int t = static_cast<int>(threadIdx.x);
  if (t < live) {
    const int slot = m.slot[t];
    p.to[blockIdx.x * kTileLeaves + threadIdx.x] = {m.making[slot].w, m.name[slot]};
    if (t == 0 && p.tile_count == 1) *p.root = {m.making[slot].w, m.making[slot].z};
  }
  if (t == 0) p.to_counts[blockIdx.x] = static_cast<std::uint32_t>(live);
}

// --- Placing ---

/// Four lanes copy a node: writes of whole sectors, one after the other.
__global__ void __launch_bounds__(kPlacing) place_kernel(NodesMaking making, const TreeRoot* root, LightNode* placed) {
  constexpr std::uint32_t kParts = sizeof(LightNode) / sizeof(uint4);
  static_assert(offsetof(LightNode, first_child) == 3 * sizeof(uint4) + 2 * sizeof(std::uint32_t));
  const std::uint32_t k = blockIdx.x * kPlacing + threadIdx.x, lane = threadIdx.x % kWarp;
  ChildPlaces places{{kNone, kNone}, 0, {kNone, kNone}};
  if (k + 1 < making.leaf_count) places = child_places(making, root->id, k);
  for (std::uint32_t first = 0; first < 2 * kWarp; first += kWarp / kParts) {
    const std::uint32_t child = first + lane / kParts, part = lane % kParts;
    const int owner = static_cast<int>(child / 2);
    const std::uint32_t id_0 = __shfl_sync(kAllLanes, places.id[0], owner);
    const std::uint32_t id_1 = __shfl_sync(kAllLanes, places.id[1], owner);
    const std::uint32_t first_child_0 = __shfl_sync(kAllLanes, places.first_child[0], owner);
    const std::uint32_t first_child_1 = __shfl_sync(kAllLanes, places.first_child[1], owner);
    const std::uint32_t block = __shfl_sync(kAllLanes, places.block, owner);
    const bool second = child % 2 != 0;
    const std::uint32_t id = second ? id_1 : id_0;
    if (id == kNone) continue;
    uint4 words = reinterpret_cast<const uint4*>(making.nodes + id)[part];
    if (part == kParts - 1) words.z = second ? first_child_1 : first_child_0;
    reinterpret_cast<uint4*>(placed + block + (second ? 1 : 0))[part] = words;
  }
  if (k == 0) PlaceChildren{making, root, placed}.place_root();
}

// --- Launching ---

template <bool Colored, int Size, int Threads, int Blocks, bool Shared, class Load>
void launch(const Device& device, const TilePass& pass, const Load& loads) {
  auto* const kernel = merge_tiles_kernel<Colored, Size, Threads, Blocks, Shared, Load>;
  constexpr std::size_t kShared = sizeof(TileMemory<Size>);
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(kShared)),
        "setting up shared memory");
  kernel<<<pass.tile_count, Threads, kShared, device.stream()>>>(pass, loads);
  check(cudaGetLastError(), "building a light tree");
}

/// Where the tiles do not fill the device, more threads share what one would do.
template <bool Colored, int Size, class Load>
void launch_tiles(const Device& device, const TilePass& pass, const Load& loads) {
  if (pass.tile_count > static_cast<std::uint32_t>(device.multiprocessors())) {
    launch<Colored, Size, 256, 2, true>(device, pass, loads);
  } else {
    launch<Colored, Size, 512, 1, true>(device, pass, loads);
  }
}

bool colored(const TilePass& pass) {
  const Metric metric = pass.making.scale.metric;
  return metric == Metric::distance_color || metric == Metric::distance_color_direction;
}

}  // namespace

bool TreeExecutor::fills_the_device(const TilePass& pass) const {
  return pass.tile_count > static_cast<std::uint32_t>(4 * device().multiprocessors());
}

void TreeExecutor::merge_many_leaves(const MakeLeaves<Vpl>& make, const TilePass& pass) {
  const LoadLights<Vpl> loads{make};
  if (colored(pass)) {
    launch<true, kLeafTile, 128, 7, false>(device(), pass, loads);
  } else {
    launch<false, kLeafTile, 128, 7, false>(device(), pass, loads);
  }
}

void TreeExecutor::merge_leaf_tiles(const TilePass& pass) {
  if (colored(pass)) {
    launch_tiles<true, kLeafTile>(device(), pass, LoadLeaves{});
  } else {
    launch_tiles<false, kLeafTile>(device(), pass, LoadLeaves{});
  }
}

void TreeExecutor::merge_tiles(const TilePass& pass) {
  if (colored(pass)) {
    launch_tiles<true, kUpperTile>(device(), pass, LoadTiles{});
  } else {
    launch_tiles<false, kUpperTile>(device(), pass, LoadTiles{});
  }
}

void TreeExecutor::place(const NodesMaking& making, const TreeRoot* root, LightNode* placed) {
  const std::uint32_t blocks = (making.leaf_count - 1 + kPlacing - 1) / kPlacing;
  place_kernel<<<blocks, kPlacing, 0, device().stream()>>>(making, root, placed);
  check(cudaGetLastError(), "placing a light tree's nodes");
}

}  // namespace lightcuts::cuda
