#include "cpu/tree/build_light_trees.h"

#include <fmt/format.h>

#include <fstream>
#include <limits>
#include <string>

#include "cpu/tree/agglomerative.h"
#include "cpu/tree/assemble_tree.h"
#include "cpu/tree/leaf_clusters.h"
#include "cpu/tree/ploc.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

constexpr std::uint64_t kMostLights = 0x7fffffffu;

/// Memory that a process may still take [bytes], as the kernel estimates it; no limit where it does not say.
std::uint64_t available_memory() {
  std::ifstream file("/proc/meminfo");
  std::string key, unit;
  std::uint64_t kilobytes = 0;
  while (file >> key >> kilobytes) {
    if (key == "MemAvailable:") return kilobytes * 1024;
    std::getline(file, unit);
  }
  return std::numeric_limits<std::uint64_t>::max();
}

void check_size(std::uint64_t light_count, TreeBuilder builder) {
  if (light_count > kMostLights) {
    throw Error(Code::invalid_argument,
                fmt::format("A light tree holds at most {} lights of one kind, but there are {}: use fewer VPLs.",
                            kMostLights, light_count));
  }
  const std::uint64_t needed = light_tree_build_bytes(light_count, builder), available = available_memory();
  if (needed > available) {
    throw Error(
        Code::out_of_memory,
        fmt::format("Building the light tree over {} lights takes {} MiB of memory, but only {} MiB are free: use "
                    "fewer VPLs.",
                    light_count, needed >> 20, available >> 20));
  }
}

/// Above this many lights the greedy builder starts from clusters that locally ordered rounds made, with a wide window:
/// cuts grow by less than 1 % (docs/results/tree.md), and a million lights take seconds.
constexpr std::uint32_t kMostGreedyClusters = 32768;
constexpr PlocOptions kBelowGreedy{.radius = 24, .greedy_below = kMostGreedyClusters, .layout = {}};

/// Builds a tree; empty if stopped.
LightTree build_one(const LeafClusters& leaves, const TreeOptions& options, const BuildProgress& progress) {
  if (leaves.clusters.empty()) return {};
  MergeTree merges;
  switch (options.builder) {
    case TreeBuilder::agglomerative:
      merges = build_ploc(leaves, kBelowGreedy, progress);
      break;
    case TreeBuilder::ploc:
      merges = build_ploc(leaves, {}, progress);
      break;
    case TreeBuilder::morton:
      merges = build_morton(leaves);
      break;
  }
  if (merges.leaf_count() != leaves.clusters.size()) return {};
  return assemble_tree(merges, leaves.clusters, options.seed);
}

}  // namespace

std::uint64_t light_tree_build_bytes(std::uint64_t light_count, TreeBuilder builder) {
  // Leaf clusters, the builder's own copy and indices, then nodes and details; the measured peak of ten million lights is
  // 250 bytes a light (docs/results/tree.md).
  const std::uint64_t bytes_a_light = builder == TreeBuilder::morton ? 260 : 300;
  return light_count * bytes_a_light;
}

LightTrees build_light_trees(const Lights& lights, float scene_diagonal, const TreeOptions& options,
                             const ProgressFn& progress) {
  check_size(lights.vpls.size(), options.builder);
  check_size(lights.points.size(), options.builder);
  check_size(lights.directionals.size(), options.builder);

  const auto total = static_cast<double>(max_of<std::uint64_t>(lights.count(), 1));
  double before = 0;
  bool go_on = true;
  const auto build = [&](const auto& kind, const auto& make_leaves) -> LightTree {
    if (kind.empty() || !go_on) return {};
    const auto size = static_cast<double>(kind.size());
    const BuildProgress report = [&](double done) {
      if (progress && !progress("tree", (before + done * size) / total)) go_on = false;
      return go_on;
    };
    LightTree tree = report(0) ? build_one(make_leaves(), options, report) : LightTree{};
    before += size;
    return tree;
  };
  LightTrees trees;
  trees.vpls = build(lights.vpls, [&] { return leaf_clusters(lights.vpls, options.metric, scene_diagonal); });
  trees.points = build(lights.points, [&] { return leaf_clusters(lights.points, options.metric, scene_diagonal); });
  trees.directionals = build(lights.directionals, [&] { return leaf_clusters(lights.directionals, options.metric); });
  if (!go_on) return {};
  if (progress) progress("tree", 1);
  return trees;
}

}  // namespace lightcuts
