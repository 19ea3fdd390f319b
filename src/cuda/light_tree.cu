#include "cuda/light_tree.h"

#include <cub/block/block_scan.cuh>
#include <string>

#include "backend/build_light_tree.h"
#include "cuda/executor.cuh"
#include "cuda/staged_light.cuh"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

constexpr int kWarp = 32;
constexpr int kSlots = kFrontierSize / kWarp;  ///< of the frontier, in each lane

struct Candidate {
  float power;  ///< luminance of the node, below 0 for a leaf and for an empty place
  std::uint32_t slot;
};
__device__ inline Candidate better(Candidate a, Candidate b) {
  return a.power > b.power || (a.power == b.power && a.slot < b.slot) ? a : b;
}

/// One warp finds the nodes of an upper level, the brightest split first, and stages their representatives.
template <int kind>
__global__ void frontier_kernel(const LightNode* nodes, LightArrays lights, std::uint32_t wanted,
                                StagedLight* frontier) {
  const int lane = static_cast<int>(threadIdx.x);
  std::uint32_t index[kSlots], child[kSlots];
  float power[kSlots];
  const auto put = [&](int s, std::uint32_t node) {
    index[s] = node;
    child[s] = nodes[node].first_child;
    power[s] = child[s] == kNone ? -1.0f : max_of(luminance(nodes[node].intensity), 0.0f);
  };
#pragma unroll
  for (int s = 0; s < kSlots; ++s) {
    index[s] = child[s] = kNone;
    power[s] = -2;
  }
  if (lane == 0) put(0, 0);
  for (std::uint32_t count = 1; count < wanted; ++count) {
    Candidate best{-2, 0};
#pragma unroll
    for (int s = 0; s < kSlots; ++s) best = better(best, {power[s], static_cast<std::uint32_t>(s * kWarp + lane)});
#pragma unroll
    for (int step = kWarp / 2; step > 0; step /= 2) {
      const Candidate other{__shfl_xor_sync(~0u, best.power, step), __shfl_xor_sync(~0u, best.slot, step)};
      best = better(best, other);
    }
    std::uint32_t first = kNone;
#pragma unroll
    for (int s = 0; s < kSlots; ++s) {
      if (best.slot == static_cast<std::uint32_t>(s * kWarp + lane)) first = child[s];
    }
    first = __shfl_sync(~0u, first, static_cast<int>(best.slot % kWarp));
    if (first == kNone) break;  // leaves alone
#pragma unroll
    for (int s = 0; s < kSlots; ++s) {
      const auto slot = static_cast<std::uint32_t>(s * kWarp + lane);
      if (slot == best.slot) put(s, first);
      if (slot == count) put(s, first + 1);
    }
  }
#pragma unroll
  for (int s = 0; s < kSlots; ++s) {
    if (index[s] == kNone) continue;
    const LightNode& node = nodes[index[s]];
    frontier[s * kWarp + lane] = stage_light<kind>(lights, node.representative, node.intensity);
  }
}

/// One block takes a tree apart: nodes with more than their share of the leaves are split until the places are taken.
__global__ void __launch_bounds__(kTreeParts)
    parts_kernel(const LightNode* nodes, std::uint32_t leaf_count, std::uint32_t* parts) {
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

LightArrays arrays_of(const DeviceLights& d) {
  return {d.vpls.data(), d.points.data(), d.directionals.data(), d.vpl_count, d.point_count, d.directional_count};
}

void make_frontier(Device& device, const DeviceLights& lights, int kind, DeviceTree& tree) {
  if (tree.leaf_count == 0) return;
  const std::uint32_t wanted = min_of(kFrontierSize, tree.leaf_count);
  tree.frontier = DeviceBuffer<StagedLight>(device, wanted);
  void (*const kernel)(const LightNode*, LightArrays, std::uint32_t, StagedLight*) =
      kind == vpl_kind     ? frontier_kernel<vpl_kind>
      : kind == point_kind ? frontier_kernel<point_kind>
                           : frontier_kernel<directional_kind>;
  kernel<<<1, kWarp, 0, device.stream()>>>(tree.storage.data() + 1, arrays_of(lights), wanted, tree.frontier.data());
  tree.parts = DeviceBuffer<std::uint32_t>(device, kTreeParts);
  parts_kernel<<<1, kTreeParts, 0, device.stream()>>>(tree.storage.data() + 1, tree.leaf_count, tree.parts.data());
  check(cudaGetLastError(), "looking for a tree's brightest nodes");
}

template <class Light>
DeviceTree build_one(Device& device, const DeviceBuffer<Light>& lights, std::uint32_t count,
                     const LightTreeBuild& options) {
  if (count > kMostTreeLights) {
    throw Error(Code::invalid_argument, "A light tree on the GPU holds at most " + std::to_string(kMostTreeLights) +
                                            " lights of one kind, but there are " + std::to_string(count) +
                                            ": use fewer VPLs.");
  }
  CudaExecutor exec(device);
  BuiltLightTree<CudaExecutor> built = build_light_tree(exec, lights.data(), count, options);
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
  for (int kind = 0; kind < kKinds; ++kind) make_frontier(device, lights, kind, trees.kind[kind]);
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
    make_frontier(device, lights, kind, tree);
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
