#include "cuda/light_tree.h"

#include <cub/block/block_scan.cuh>
#include <string>

#include "cuda/staged_light.cuh"
#include "cuda/tree_rounds.cuh"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

constexpr int kWarp = 32;
constexpr int kSlots = kFrontierSize / kWarp;  ///< of the frontier, in each lane

__device__ inline std::uint32_t warp_most(std::uint32_t v) {
#if __CUDA_ARCH__ >= 800
  return __reduce_max_sync(~0u, v);
#else
  for (int step = kWarp / 2; step > 0; step /= 2) v = max_of(v, __shfl_xor_sync(~0u, v, step));
  return v;
#endif
}

/// A place in the list of an upper level's nodes.
struct FrontierSlot {
  std::uint32_t node, first_child;
  /// Bits of a power that is not negative are in its order; 0: a leaf, or an empty place. One is added, so that dark
  /// clusters split too, the brightest first all the same.
  std::uint32_t order;

  __device__ void set(const LightNode* nodes, std::uint32_t of) {
    node = of;
    first_child = nodes[of].first_child;
    order = first_child == kNone ? 0 : __float_as_uint(max_of(luminance(nodes[of].intensity), 0.0f)) + 1;
  }
};

/// Of these slots, how many others split before `slot`: brighter ones, or equal ones further down.
__device__ inline std::uint32_t rank_of(const FrontierSlot* slots, std::uint32_t count, std::uint32_t slot) {
  std::uint32_t rank = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (slots[k].order > slots[slot].order || (slots[k].order == slots[slot].order && k < slot)) ++rank;
  }
  return rank;
}

/// One warp finds the nodes of an upper level and stages their representatives. The brightest are split first; those at
/// least half as bright as the brightest at once, for each split waits for memory.
template <int kind>
__device__ void find_frontier(const LightNode* nodes, LightArrays lights, std::uint32_t wanted, StagedLight* frontier) {
  constexpr std::uint32_t kHalf = 1u << 23;  // of the bits of a float: an exponent less
  const auto lane = static_cast<std::uint32_t>(threadIdx.x);
  __shared__ FrontierSlot slots[kFrontierSize];
  if (lane == 0) slots[0].set(nodes, 0);
  __syncwarp();
  std::uint32_t count = 1;
  while (count < wanted) {
    std::uint32_t most = 0;
    for (std::uint32_t k = lane; k < count; k += kWarp) most = max_of(most, slots[k].order);
    most = warp_most(most);
    if (most == 0) break;  // leaves alone
    const std::uint32_t least = most > kHalf ? most - kHalf : 1, room = wanted - count;
    bool bright[kSlots];
    std::uint32_t place[kSlots], candidates = 0, before = count;
#pragma unroll
    for (int s = 0; s < kSlots; ++s) {
      const std::uint32_t slot = static_cast<std::uint32_t>(s * kWarp) + lane;
      bright[s] = slot < count && slots[slot].order >= least;
      candidates += static_cast<std::uint32_t>(__popc(__ballot_sync(~0u, bright[s])));
    }
#pragma unroll
    for (int s = 0; s < kSlots; ++s) {
      const std::uint32_t slot = static_cast<std::uint32_t>(s * kWarp) + lane;
      const bool splits = bright[s] && (candidates <= room || rank_of(slots, count, slot) < room);
      const std::uint32_t all = __ballot_sync(~0u, splits);
      place[s] = splits ? before + static_cast<std::uint32_t>(__popc(all & ((1u << lane) - 1))) : kNone;
      before += static_cast<std::uint32_t>(__popc(all));
    }
    __syncwarp();
#pragma unroll
    for (int s = 0; s < kSlots; ++s) {
      if (place[s] == kNone) continue;
      FrontierSlot& slot = slots[static_cast<std::uint32_t>(s * kWarp) + lane];
      const std::uint32_t first = slot.first_child;
      FrontierSlot second;
      second.set(nodes, first + 1);
      slot.set(nodes, first);
      slots[place[s]] = second;
    }
    count = before;
    __syncwarp();
  }
  for (std::uint32_t k = lane; k < count; k += kWarp) {
    const LightNode& node = nodes[slots[k].node];
    frontier[k] = stage_light<kind>(lights, node.representative, node.intensity);
  }
}

/// One block takes a tree apart: nodes with more than their share of the leaves are split until the places are taken.
__device__ void find_parts(const LightNode* nodes, std::uint32_t leaf_count, std::uint32_t* parts) {
  using Scan = cub::BlockScan<std::uint32_t, kTreeParts>;
  __shared__ typename Scan::TempStorage storage;
  __shared__ std::uint32_t list[kTreeParts];
  const std::uint32_t place = threadIdx.x, share = leaf_count / (kTreeParts / 2) + 1;
  list[place] = place == 0 ? 0 : kNone;
  __syncthreads();
  for (std::uint32_t count = 1;;) {
    const std::uint32_t node = list[place];
    const bool splits = node != kNone && nodes[node].leaf_count > share;
    std::uint32_t before = 0, total = 0;
    Scan(storage).ExclusiveSum(splits ? 1u : 0u, before, total);
    __syncthreads();
    if (total == 0) break;
    // In the order of places, as many as there is room for.
    if (splits && count + before < kTreeParts) {
      list[place] = nodes[node].first_child;
      list[count + before] = nodes[node].first_child + 1;
    }
    __syncthreads();
    if (count + total >= kTreeParts) break;
    count += total;
  }
  parts[place] = list[place];
}

/// What walks start from: the frontier by the first block, the parts by the second.
template <int kind>
__global__ void __launch_bounds__(kTreeParts)
    starts_kernel(const LightNode* nodes, std::uint32_t leaf_count, LightArrays lights, std::uint32_t wanted,
                  StagedLight* frontier, std::uint32_t* parts) {
  if (blockIdx.x != 0) {
    find_parts(nodes, leaf_count, parts);
  } else if (threadIdx.x < kWarp) {
    find_frontier<kind>(nodes, lights, wanted, frontier);
  }
}

LightArrays arrays_of(const DeviceLights& d) {
  return {d.vpls.data(), d.points.data(), d.directionals.data(), d.vpl_count, d.point_count, d.directional_count};
}

void find_starts(Device& device, const DeviceLights& lights, int kind, DeviceTree& tree) {
  if (tree.leaf_count == 0) return;
  const std::uint32_t wanted = min_of(kFrontierSize, tree.leaf_count);
  tree.frontier = DeviceBuffer<StagedLight>(device, wanted);
  tree.parts = DeviceBuffer<std::uint32_t>(device, kTreeParts);
  auto* const kernel = kind == vpl_kind     ? starts_kernel<vpl_kind>
                       : kind == point_kind ? starts_kernel<point_kind>
                                            : starts_kernel<directional_kind>;
  kernel<<<2, kTreeParts, 0, device.stream()>>>(tree.storage.data() + 1, tree.leaf_count, arrays_of(lights), wanted,
                                                tree.frontier.data(), tree.parts.data());
  check(cudaGetLastError(), "looking for where walks of a tree start");
}

template <class Light>
DeviceTree build_one(Device& device, const DeviceBuffer<Light>& lights, std::uint32_t count,
                     const LightTreeBuild& options) {
  if (count > kMostTreeLights) {
    throw Error(Code::invalid_argument, "A light tree on the GPU holds at most " + std::to_string(kMostTreeLights) +
                                            " lights of one kind, but there are " + std::to_string(count) +
                                            ": use fewer VPLs.");
  }
  TreeExecutor exec(device);
  BuiltLightTree<TreeExecutor> built = build_light_tree(exec, lights.data(), count, options);
  DeviceTree tree;
  tree.storage = std::move(built.storage);
  tree.leaf_count = built.leaf_count;
  tree.depth = built.depth;
  return tree;
}

LightTreeBuild options_for(const TreeOptions& options, float extent, float direction_extent) {
  LightTreeBuild build;
  build.scale = {options.metric, extent > 0 ? 1 / extent : 1.0f, direction_extent * direction_extent};
  build.seed = options.seed;
  return build;
}

/// Indices that a walk follows must lie inside, and children behind their parents: a walk then ends.
bool walkable(const LightTree& tree, std::uint32_t light_count) {
  const std::size_t count = light_count == 0 ? 0 : 2 * std::size_t{light_count} - 1;
  if (tree.nodes.size() != count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const LightNode& node = tree.nodes[i];
    if (node.representative >= light_count) return false;
    if (!node.is_leaf() && (node.first_child <= i || std::size_t{node.first_child} + 1 >= count)) return false;
  }
  return true;
}

}  // namespace

TreeView DeviceTree::view() const {
  if (leaf_count == 0) return {};
  return {storage.data() + 1, leaf_count, frontier.data(), static_cast<std::uint32_t>(frontier.size()), parts.data()};
}

DeviceTrees build_light_trees(Device& device, const DeviceLights& lights, float scene_diagonal,
                              const TreeOptions& options) {
  DeviceTrees trees;
  trees.kind[vpl_kind] =
      build_one(device, lights.vpls, lights.vpl_count, options_for(options, scene_diagonal, scene_diagonal));
  trees.kind[point_kind] =
      build_one(device, lights.points, lights.point_count, options_for(options, scene_diagonal, 0));
  trees.kind[directional_kind] =
      build_one(device, lights.directionals, lights.directional_count, options_for(options, 2, 0));
  for (int kind = 0; kind < kKinds; ++kind) find_starts(device, lights, kind, trees.kind[kind]);
  return trees;
}

DeviceTrees upload_light_trees(Device& device, const LightTrees& trees, const DeviceLights& lights) {
  const LightTree* const hosts[kKinds] = {&trees.vpls, &trees.points, &trees.directionals};
  const std::uint32_t counts[kKinds] = {lights.vpl_count, lights.point_count, lights.directional_count};
  DeviceTrees result;
  for (int kind = 0; kind < kKinds; ++kind) {
    if (!walkable(*hosts[kind], counts[kind])) {
      throw Error(Code::invalid_argument, "the light trees are not those of the lights; call build_light_tree first");
    }
    DeviceTree& tree = result.kind[kind];
    if (counts[kind] == 0) continue;
    tree.leaf_count = counts[kind];
    tree.depth = hosts[kind]->depth;
    tree.storage = DeviceBuffer<LightNode>(device, hosts[kind]->nodes.size() + 1);
    check(cudaMemcpyAsync(tree.storage.data() + 1, hosts[kind]->nodes.data(),
                          hosts[kind]->nodes.size() * sizeof(LightNode), cudaMemcpyHostToDevice, device.stream()),
          "sending a light tree");
    find_starts(device, lights, kind, tree);
  }
  device.synchronize();  // the host's nodes may go now
  return result;
}

LightTrees download_light_trees(const DeviceTrees& trees) {
  LightTrees result;
  LightTree* const hosts[kKinds] = {&result.vpls, &result.points, &result.directionals};
  for (int kind = 0; kind < kKinds; ++kind) {
    const DeviceTree& tree = trees.kind[kind];
    if (tree.leaf_count == 0) continue;
    hosts[kind]->nodes = std::vector<LightNode>(tree.node_count());
    tree.storage.download(hosts[kind]->nodes.data(), tree.node_count(), 1);
    hosts[kind]->depth = tree.depth;
  }
  return result;
}

}  // namespace lightcuts::cuda
