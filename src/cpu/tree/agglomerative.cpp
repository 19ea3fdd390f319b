#include "cpu/tree/agglomerative.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <deque>
#include <numeric>
#include <queue>
#include <tuple>

#include "cpu/tree/cluster_kd_tree.h"

namespace lightcuts {
namespace {

/// Greedy merging in two phases: pairs of size 0 by their order of ids alone, then all others by search and queue.
/// Without the first phase lights that agree would all name the one with the lowest id, and search anew at each merge.
class GreedyMerging {
 public:
  GreedyMerging(const LeafClusters& leaves, const BuildProgress& progress)
      : scale_(leaves.scale),
        progress_(progress),
        light_count_(static_cast<std::uint32_t>(leaves.clusters.size())),
        tree_(leaves.scale, 2 * light_count_ - 1) {
    merges_.children.reserve(light_count_ - 1);
    merge_identical(leaves.clusters);
  }

  MergeTree run() {
    fill_queue();
    while (tree_.live_count() > 1) {
      if (merges_.children.size() % 4096 == 0 && !report()) return {};
      const Candidate top = queue_.top();
      queue_.pop();
      if (!tree_.contains(top.owner)) continue;
      const std::uint32_t partner = top.low == top.owner ? top.high : top.low;
      if (!tree_.contains(partner)) {
        push_best(top.owner);
        continue;
      }
      const std::uint32_t merged = add_merge(top.low, top.high);
      tree_.merge(top.low, top.high, merged, unite(tree_.cluster(top.low), tree_.cluster(top.high)));
      rebuild_if_sparse();
      if (tree_.live_count() > 1) push_best(merged);
    }
    return std::move(merges_);
  }

 private:
  /// A pair that a live cluster, the owner, found to be its best.
  struct Candidate {
    float size;
    std::uint32_t low, high, owner;
    /// Order of a queue whose top is the smallest.
    friend bool operator<(const Candidate& a, const Candidate& b) {
      return std::tie(a.size, a.low, a.high) > std::tie(b.size, b.low, b.high);
    }
  };

  /// What two clusters must share to be of size 0 together.
  [[nodiscard]] auto identity(const LightCluster& c) const {
    const bool by_axis = scale_.metric == Metric::walter ? scale_.direction_extent_sq > 0
                                                         : scale_.metric == Metric::distance_direction ||
                                                               scale_.metric == Metric::distance_color_direction;
    const bool by_color = scale_.metric == Metric::distance_color || scale_.metric == Metric::distance_color_direction;
    const Vec3 p = c.box.lo, n = by_axis ? c.cone.axis : Vec3{};
    const float cosine = by_axis ? c.cone.cos_half_angle : 1.0f;
    const Chromaticity k = by_color ? c.color : Chromaticity{};
    return std::tuple(p.x, p.y, p.z, n.x, n.y, n.z, cosine, k.a, k.b, k.chroma);
  }

  std::uint32_t add_merge(std::uint32_t low, std::uint32_t high) {
    merges_.children.push_back({low, high});
    return light_count_ + static_cast<std::uint32_t>(merges_.children.size()) - 1;
  }

  void merge_identical(std::vector<LightCluster> clusters);
  void fill_queue();
  void push_best(std::uint32_t id);
  void rebuild_if_sparse();
  [[nodiscard]] bool report() const {
    return !progress_ || progress_(static_cast<double>(merges_.children.size()) / light_count_);
  }

  MetricScale scale_;
  BuildProgress progress_;
  std::uint32_t light_count_;
  ClusterKdTree tree_;
  MergeTree merges_;
  std::priority_queue<Candidate> queue_;
};

void GreedyMerging::merge_identical(std::vector<LightCluster> clusters) {
  std::vector<std::uint32_t> order(light_count_);
  std::iota(order.begin(), order.end(), 0u);
  tbb::parallel_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto ka = identity(clusters[a]), kb = identity(clusters[b]);
    return ka < kb || (ka == kb && a < b);
  });

  // Groups of two or more, each in order of ids; the group whose first id is lowest merges next.
  std::vector<std::deque<std::uint32_t>> groups;
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    for (end = begin + 1; end < order.size() && identity(clusters[order[end]]) == identity(clusters[order[begin]]);)
      ++end;
    if (end - begin > 1) {
      groups.emplace_back(order.begin() + static_cast<std::ptrdiff_t>(begin),
                          order.begin() + static_cast<std::ptrdiff_t>(end));
    }
  }
  std::vector<std::uint32_t> ids(light_count_);
  std::iota(ids.begin(), ids.end(), 0u);
  if (!groups.empty()) {
    const auto later = [&](std::size_t a, std::size_t b) { return groups[a].front() > groups[b].front(); };
    std::priority_queue<std::size_t, std::vector<std::size_t>, decltype(later)> next(later);
    for (std::size_t g = 0; g < groups.size(); ++g) next.push(g);
    std::vector<bool> dead(light_count_, false);
    while (!next.empty()) {
      const std::size_t g = next.top();
      next.pop();
      std::deque<std::uint32_t>& group = groups[g];
      const std::uint32_t low = group[0], high = group[1];
      group.erase(group.begin(), group.begin() + 2);
      dead[low] = dead[high] = true;
      dead.push_back(false);
      clusters.push_back(unite(clusters[low], clusters[high]));
      group.push_back(add_merge(low, high));
      ids.push_back(group.back());
      if (group.size() > 1) next.push(g);
    }
    std::size_t live = 0;
    for (std::size_t i = 0; i < clusters.size(); ++i) {
      if (dead[i]) continue;
      clusters[live] = clusters[i];
      ids[live++] = ids[i];
    }
    clusters.resize(live);
    ids.resize(live);
  }
  tree_.build(std::move(clusters), std::move(ids));
}

void GreedyMerging::fill_queue() {
  if (tree_.live_count() < 2) return;
  std::vector<LightCluster> clusters;
  std::vector<std::uint32_t> ids;
  tree_.take_live(clusters, ids);
  std::vector<Candidate> first(ids.size());
  tbb::parallel_for(std::size_t{0}, ids.size(), [&](std::size_t i) {
    const Partner best = tree_.best_partner(ids[i]);
    first[i] = {best.size, min_of(ids[i], best.id), max_of(ids[i], best.id), ids[i]};
  });
  queue_ = std::priority_queue<Candidate>(std::less<Candidate>(), std::move(first));
}

void GreedyMerging::push_best(std::uint32_t id) {
  const Partner best = tree_.best_partner(id);
  queue_.push({best.size, min_of(id, best.id), max_of(id, best.id), id});
}

void GreedyMerging::rebuild_if_sparse() {
  if (tree_.built_count() < 64 || 2 * tree_.live_count() > tree_.built_count()) return;
  std::vector<LightCluster> clusters;
  std::vector<std::uint32_t> ids;
  tree_.take_live(clusters, ids);
  tree_.build(std::move(clusters), std::move(ids));
}

}  // namespace

MergeTree build_agglomerative(const LeafClusters& leaves, const BuildProgress& progress) {
  return GreedyMerging(leaves, progress).run();
}

}  // namespace lightcuts
