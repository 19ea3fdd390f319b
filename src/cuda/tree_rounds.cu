#include "cuda/tree_rounds.cuh"

#include <cooperative_groups.h>

#include <algorithm>
#include <cstddef>
#include <cub/block/block_scan.cuh>

// How a round of merging is one pass: a block stages a tile of clusters and what lies within two search windows of it,
// finds the partners of those within one, merges its own, and learns from the tiles before it where to write (a prefix
// sum with look-back: Merrill, Garland 2016; one kernel a round: Benthin et al. 2022, PLOC++). Ids and places depend on
// the order of tiles alone, never on which block was first.

namespace lightcuts::cuda {
namespace {

namespace cg = cooperative_groups;
using namespace lightcuts::detail;

constexpr int kWarp = 32;
constexpr std::uint32_t kAllLanes = 0xffffffffu;

/// What a build's kernels tell each other.
struct Progress {
  std::uint32_t live;    ///< clusters left
  std::uint32_t new_id;  ///< of the next merged node
  std::uint32_t buffer;  ///< which of the two arrays of ids holds the clusters
  int reluctance;
};

struct Rounds {
  NodesMaking making;
  std::uint32_t* ids[2];
  std::uint64_t* tiles[3];  ///< of a round, the next and the one after: sums of the tiles before
  Progress* progress;
  std::uint32_t radius, search_all_below;
};

// --- Clusters in shared memory, a field at a time: neighbouring threads read neighbouring words ---

template <int Count>
struct Staged {
  float lo[3][Count], hi[3][Count], axis[3][Count], cosine[Count], sine[Count], luminance[Count];
  float color[3][Count];

  __device__ void put(int at, const SizedCluster& c) {
    const Vec3 &l = c.cluster.box.lo, &h = c.cluster.box.hi, &a = c.cluster.cone.axis;
    lo[0][at] = l.x, lo[1][at] = l.y, lo[2][at] = l.z;
    hi[0][at] = h.x, hi[1][at] = h.y, hi[2][at] = h.z;
    axis[0][at] = a.x, axis[1][at] = a.y, axis[2][at] = a.z;
    cosine[at] = c.cluster.cone.cos_half_angle;
    sine[at] = c.sine;
    luminance[at] = c.cluster.luminance;
    const Vec3 i = c.cluster.intensity;
    color[0][at] = i.x, color[1][at] = i.y, color[2][at] = i.z;
  }

  /// `Colored`: with what metrics of colour ask for.
  template <bool Colored>
  __device__ SizedCluster get(int at) const {
    SizedCluster c;
    c.cluster.box = {{lo[0][at], lo[1][at], lo[2][at]}, {hi[0][at], hi[1][at], hi[2][at]}};
    c.cluster.cone = {{axis[0][at], axis[1][at], axis[2][at]}, cosine[at]};
    c.sine = sine[at];
    c.cluster.luminance = luminance[at];
    if constexpr (Colored) {
      c.cluster.intensity = {color[0][at], color[1][at], color[2][at]};
      c.cluster.color = chromaticity(c.cluster.intensity);
    }
    return c;
  }
};

// --- Rounds of many clusters ---

constexpr int kTile = 256;  ///< clusters that a block of as many threads stages; it merges those in the middle

/// On each side: the windows of its partners' partners, and the neighbour that reluctant clusters are paired with.
__host__ __device__ int halo_of(std::uint32_t radius) { return 2 * static_cast<int>(radius) + 2; }
/// Clusters that a tile merges; their first one has an even place.
__host__ __device__ int owned_of(std::uint32_t radius) { return kTile - 2 * halo_of(radius); }
static_assert(kTile > 4 * (static_cast<int>(kLargestPlocRadius) + 1));

/// A tile's sum: merged clusters in the upper half, those that stay in the lower, and what it is a sum of.
constexpr std::uint64_t kOwnSum = std::uint64_t{1} << 62, kSumSoFar = std::uint64_t{2} << 62;
constexpr std::uint64_t kSumBits = kOwnSum - 1;

__device__ std::uint64_t read_tile(const std::uint64_t* tile) {
  return *const_cast<const volatile std::uint64_t*>(tile);
}
__device__ void write_tile(std::uint64_t* tile, std::uint64_t sum) { *const_cast<volatile std::uint64_t*>(tile) = sum; }

/// The sum of all tiles before `tile`, by one warp; leaves the sum that includes `own` for those behind.
__device__ std::uint64_t look_back(std::uint64_t* tiles, std::uint32_t tile, std::uint64_t own) {
  const auto lane = static_cast<std::int64_t>(threadIdx.x % kWarp);
  if (lane == 0) write_tile(tiles + tile, own | (tile == 0 ? kSumSoFar : kOwnSum));
  std::uint64_t before = 0;
  for (std::int64_t last = static_cast<std::int64_t>(tile) - 1; last >= 0; last -= kWarp) {
    const std::int64_t at = last - lane;
    std::uint64_t sum = at < 0 ? kSumSoFar : 0;
    while (__any_sync(kAllLanes, sum == 0)) {
      if (sum == 0) sum = read_tile(tiles + at);
    }
    const std::uint32_t complete = __ballot_sync(kAllLanes, (sum & kSumSoFar) != 0);
    const bool counts = complete == 0 || lane < __ffs(static_cast<int>(complete));
    std::uint64_t part = counts ? sum & kSumBits : 0;
    for (int step = kWarp / 2; step > 0; step /= 2) part += __shfl_xor_sync(kAllLanes, part, step);
    before += part;
    if (complete != 0) break;
  }
  if (lane == 0 && tile != 0) write_tile(tiles + tile, (before + own) | kSumSoFar);
  return before;
}

/// A round as one of its tiles sees it.
struct Round {
  const std::uint32_t* ids;
  std::uint32_t* next_ids;
  std::uint64_t* tiles;
  std::uint32_t live, first_new_id;
  int reluctance;
};

struct TileMemory {
  Staged<kTile> clusters;
  /// Of the pairs with a cluster further down, the smallest rank; and how far its partner is from each.
  std::uint32_t down[kTile];
  std::int32_t offset[kTile];
  cub::BlockScan<std::uint32_t, kTile>::TempStorage scan;
  std::uint64_t before;
};

/// Finds the partners of the clusters of a tile: thread t has the cluster at place base - halo + t.
template <bool Colored>
__device__ void find_partners(const NodesMaking& making, const Round& round, int g, int radius, TileMemory& memory) {
  const int t = static_cast<int>(threadIdx.x), live = static_cast<int>(round.live);
  const bool inside = g >= 0 && g < live;
  SizedCluster own;
  memory.down[t] = __float_as_uint(kInfinity);
  if (inside) {
    own = sized(making.cluster(round.ids[g]));
    memory.clusters.put(t, own);
  }
  __syncthreads();
  std::uint32_t up = __float_as_uint(kInfinity);
  if (inside) {
    const int reach = min(radius, min(live - 1 - g, kTile - 1 - t));
    for (int offset = 1; offset <= reach; ++offset) {
      const float size = pair_size(own, memory.clusters.get<Colored>(t + offset), making.scale);
      const std::uint32_t rank =
          __float_as_uint(ploc_rank(size, static_cast<std::uint32_t>(g), static_cast<std::uint32_t>(offset)));
      up = min(up, rank);
      atomicMin(memory.down + t + offset, rank);
    }
  }
  __syncthreads();
  memory.offset[t] = ploc_offset(__uint_as_float(up), __uint_as_float(memory.down[t]), static_cast<std::uint32_t>(g));
  __syncthreads();
  if (round.reluctance == 0) return;
  // Tiles and halos begin at even places.
  if (t % 2 == 0 && g >= 0 && g + 1 < live) {
    PairNeighbours{nullptr, 0, round.reluctance > 1}.apply(memory.offset + t);
  }
  __syncthreads();
}

template <bool Colored>
__device__ void merge_tile(const Rounds& p, const Round& round, std::uint32_t tile, TileMemory& memory) {
  const int halo = halo_of(p.radius), owned = owned_of(p.radius), t = static_cast<int>(threadIdx.x);
  const int g = static_cast<int>(tile) * owned - halo + t;
  find_partners<Colored>(p.making, round, g, static_cast<int>(p.radius), memory);

  const bool mine = t >= halo && t < halo + owned && g < static_cast<int>(round.live);
  const std::int32_t offset = mine ? memory.offset[t] : 0;
  const bool pairs = mine && memory.offset[t + offset] == -offset;
  const bool merges = pairs && offset > 0, stays = mine && (!pairs || merges);
  std::uint32_t place = 0, sum = 0;
  cub::BlockScan<std::uint32_t, kTile>(memory.scan)
      .ExclusiveSum((merges ? 1u << 16 : 0u) | (stays ? 1u : 0u), place, sum);
  if (t < kWarp) {
    const std::uint64_t own = std::uint64_t{sum >> 16} << 31 | (sum & 0xffffu);
    const std::uint64_t before = look_back(round.tiles, tile, own);
    if (t == 0) memory.before = before;
  }
  // The others need not wait to know what they will write, but where.
  std::uint32_t id = stays ? round.ids[g] : 0;
  MergedNode merged;
  if (merges) merged = p.making.combine(id, round.ids[g + offset]);
  __syncthreads();
  const std::uint64_t before = memory.before;
  if (merges) {
    id = round.first_new_id + static_cast<std::uint32_t>(before >> 31) + (place >> 16);
    p.making.put(id, merged);
  }
  if (stays) round.next_ids[static_cast<std::uint32_t>(before & 0x7fffffffu) + (place & 0xffffu)] = id;
  __syncthreads();
}

/// All rounds until few clusters are left. Every block follows the numbers of clusters by itself, from the last tile's sum.
template <bool Colored>
__global__ void __launch_bounds__(kTile, 2) merge_rounds_kernel(Rounds p) {
  extern __shared__ uint4 shared[];
  auto& memory = *reinterpret_cast<TileMemory*>(shared);
  cg::grid_group grid = cg::this_grid();
  std::uint32_t live = p.making.leaf_count, new_id = live, buffer = 0, done = 0;
  int reluctance = 0;
  const auto owned = static_cast<std::uint32_t>(owned_of(p.radius));
  while (live > p.search_all_below) {
    const std::uint32_t tiles = (live + owned - 1) / owned;
    const Round round{p.ids[buffer], p.ids[buffer ^ 1], p.tiles[done % 3], live, new_id, reluctance};
    std::uint64_t* const next = p.tiles[(done + 1) % 3];
    for (std::uint32_t tile = blockIdx.x; tile < tiles; tile += gridDim.x) {
      if (threadIdx.x == 0) next[tile] = 0;
      merge_tile<Colored>(p, round, tile, memory);
    }
    grid.sync();
    const std::uint64_t sum = read_tile(round.tiles + tiles - 1) & kSumBits;
    const auto merged = static_cast<std::uint32_t>(sum >> 31);
    reluctance = reluctance_after(reluctance, live, merged, p.search_all_below);
    live = static_cast<std::uint32_t>(sum & 0x7fffffffu);
    new_id += merged;
    buffer ^= 1;
    ++done;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *p.progress = {live, new_id, buffer, reluctance};
}

// --- The last rounds, each cluster looking at all others ---

constexpr int kLast = 256;          ///< clusters at most
constexpr int kLastThreads = 1024;  ///< of one block

struct LastMemory {
  Staged<kLast> clusters;
  std::uint32_t ids[kLast];
  RankedPartner best[kLast];
  bool fresh[kLast];            ///< has no partner yet that still stands
  std::uint32_t place[kLast];   ///< in the next round
  std::uint32_t merged[kLast];  ///< places of the clusters that the round before made
  cub::BlockScan<std::uint32_t, kLastThreads>::TempStorage scan;
};

__device__ RankedPartner warp_best(std::uint32_t i, RankedPartner best) {
#if __CUDA_ARCH__ >= 800
  // Sizes are not below 0, so that their bits are in their order. One lane has the best, unless there are ties.
  const std::uint32_t bits = __float_as_uint(best.size), least = __reduce_min_sync(kAllLanes, bits);
  const std::uint32_t owners = __ballot_sync(kAllLanes, bits == least);
  if (__popc(owners) == 1) {
    const int owner = __ffs(static_cast<int>(owners)) - 1;
    return {__uint_as_float(least), __shfl_sync(kAllLanes, best.place, owner)};
  }
#endif
  for (int step = kWarp / 2; step > 0; step /= 2) {
    best = FindAmongAll::better(
        i, best, {__shfl_xor_sync(kAllLanes, best.size, step), __shfl_xor_sync(kAllLanes, best.place, step)});
  }
  return best;
}

/// A cluster whose partner still stands asks only those that are new: the others were no better before.
template <bool Colored>
__device__ void find_last_partners(const MetricScale& scale, std::uint32_t live, std::uint32_t merged,
                                   LastMemory& memory) {
  const std::uint32_t lane = threadIdx.x % kWarp;
  for (std::uint32_t i = threadIdx.x / kWarp; i < live; i += kLastThreads / kWarp) {
    const bool fresh = memory.fresh[i];
    const SizedCluster own = memory.clusters.get<Colored>(static_cast<int>(i));
    RankedPartner best = fresh || lane != 0 ? RankedPartner{} : memory.best[i];
    for (std::uint32_t k = lane; k < (fresh ? live : merged); k += kWarp) {
      const std::uint32_t j = fresh ? k : memory.merged[k];
      if (j == i) continue;
      const float size = pair_size(own, memory.clusters.get<Colored>(static_cast<int>(j)), scale);
      best = FindAmongAll::better(i, best, {size, j});
    }
    best = warp_best(i, best);
    if (lane == 0) memory.best[i] = best;
  }
  __syncthreads();
}

template <bool Colored>
__global__ void __launch_bounds__(kLastThreads) merge_last_kernel(Rounds p) {
  __shared__ __align__(16) unsigned char storage[sizeof(LastMemory)];
  auto& memory = *reinterpret_cast<LastMemory*>(storage);
  const Progress progress = *p.progress;
  const std::uint32_t me = threadIdx.x;
  std::uint32_t live = progress.live, merged = 0, new_id = progress.new_id;
  int reluctance = progress.reluctance;
  if (me < live) {
    const std::uint32_t id = p.ids[progress.buffer][me];
    memory.ids[me] = id;
    memory.fresh[me] = true;
    memory.clusters.put(static_cast<int>(me), sized(p.making.cluster(id)));
  }
  __syncthreads();
  while (live > 1) {
    find_last_partners<Colored>(p.making.scale, live, merged, memory);
    if (reluctance > 0 && 2 * me + 1 < live) {
      const auto i = static_cast<std::int32_t>(2 * me);
      std::int32_t two[2] = {static_cast<std::int32_t>(memory.best[i].place) - i,
                             static_cast<std::int32_t>(memory.best[i + 1].place) - i - 1};
      PairNeighbours{nullptr, 0, reluctance > 1}.apply(two);
      memory.best[i].place = static_cast<std::uint32_t>(i + two[0]);
      memory.best[i + 1].place = static_cast<std::uint32_t>(i + 1 + two[1]);
    }
    __syncthreads();
    const bool inside = me < live;
    const RankedPartner best = inside ? memory.best[me] : RankedPartner{};
    const bool pairs = inside && memory.best[best.place].place == me;
    // A partner that merges with another one no longer stands.
    const bool forsaken = inside && memory.best[memory.best[best.place].place].place == best.place;
    const bool merges = pairs && best.place > me, stays = inside && (!pairs || merges);
    std::uint32_t place = 0, sum = 0;
    cub::BlockScan<std::uint32_t, kLastThreads>(memory.scan)
        .ExclusiveSum((merges ? 1u << 16 : 0u) | (stays ? 1u : 0u), place, sum);
    const std::uint32_t next = place & 0xffffu, parent = new_id + (place >> 16);
    std::uint32_t id = inside ? memory.ids[me] : 0;
    SizedCluster cluster;
    if (merges) {
      p.making.put(parent, p.making.combine(id, memory.ids[best.place]));
      id = parent;
      cluster = sized(p.making.cluster(parent));
    } else if (stays) {
      cluster = memory.clusters.get<true>(static_cast<int>(me));
    }
    if (inside) memory.place[me] = next;
    __syncthreads();
    if (stays) {
      memory.ids[next] = id;
      memory.clusters.put(static_cast<int>(next), cluster);
      memory.fresh[next] = merges || forsaken;
      memory.best[next] = {best.size, memory.place[best.place]};
      if (merges) memory.merged[place >> 16] = next;
    }
    __syncthreads();
    merged = sum >> 16;
    live = sum & 0xffffu;
    new_id += merged;
    reluctance = 0;
  }
}

// --- Placing ---

/// Four lanes copy a node: writes of whole sectors, one after the other.
__global__ void __launch_bounds__(kTile) place_kernel(NodesMaking making, LightNode* placed) {
  constexpr std::uint32_t kParts = sizeof(LightNode) / sizeof(uint4);
  static_assert(offsetof(LightNode, first_child) == 3 * sizeof(uint4) + 2 * sizeof(std::uint32_t));
  const std::uint32_t k = blockIdx.x * kTile + threadIdx.x, lane = threadIdx.x % kWarp;
  ChildPlaces places{{kNone, kNone}, 0, {kNone, kNone}};
  if (k + 1 < making.leaf_count) places = child_places(making, k);
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
  if (k + 2 == making.leaf_count) PlaceChildren{making, placed}.place_root();
}

// --- Launching ---

template <class Kernel>
void launch_together(const Device& device, Kernel* kernel, std::size_t shared, std::uint32_t most_blocks,
                     Rounds& rounds) {
  int at_once = 0;
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(shared)),
        "setting up shared memory");
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&at_once, kernel, kTile, shared), "planning a light tree");
  const auto blocks = std::min(most_blocks, static_cast<std::uint32_t>(at_once * device.multiprocessors()));
  void* arguments[] = {&rounds};
  check(
      cudaLaunchCooperativeKernel(kernel, dim3(std::max(blocks, 1u)), dim3(kTile), arguments, shared, device.stream()),
      "building a light tree");
}

template <bool Colored>
void launch_rounds(const Device& device, Rounds& rounds, std::uint32_t tiles) {
  launch_together(device, merge_rounds_kernel<Colored>, sizeof(TileMemory), tiles, rounds);
  merge_last_kernel<Colored><<<1, kLastThreads, 0, device.stream()>>>(rounds);
  check(cudaGetLastError(), "building a light tree");
}

}  // namespace

void TreeExecutor::merge_clusters(const NodesMaking& making, Buffer<std::uint32_t>& ids, std::uint32_t radius,
                                  std::uint32_t search_all_below) {
  const std::uint32_t count = making.leaf_count, owned = static_cast<std::uint32_t>(owned_of(radius));
  const std::uint32_t tiles = (count + owned - 1) / owned;
  Buffer<std::uint32_t> next_ids(device(), count);
  Buffer<std::uint64_t> sums(device(), std::size_t{3} * tiles);
  Buffer<Progress> progress(device(), 1);
  sums.fill_bytes(0);
  Rounds rounds{making, {ids.data(), next_ids.data()},
                {},     progress.data(),
                radius, std::min<std::uint32_t>(search_all_below, kLast)};
  for (std::size_t k = 0; k < 3; ++k) rounds.tiles[k] = sums.data() + k * tiles;
  const Metric metric = making.scale.metric;
  if (metric == Metric::distance_color || metric == Metric::distance_color_direction) {
    launch_rounds<true>(device(), rounds, tiles);
  } else {
    launch_rounds<false>(device(), rounds, tiles);
  }
}

void TreeExecutor::place(const NodesMaking& making, LightNode* placed) {
  const std::uint32_t blocks = (making.leaf_count - 1 + kTile - 1) / kTile;
  place_kernel<<<blocks, kTile, 0, device().stream()>>>(making, placed);
  check(cudaGetLastError(), "placing a light tree's nodes");
}

}  // namespace lightcuts::cuda
