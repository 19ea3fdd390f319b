#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <bit>

#include "cpu/tree/ploc.h"

namespace lightcuts {

std::vector<KeyedLight> sort_by_key(const std::vector<LightCluster>& clusters, const LightKeyLayout& layout) {
  using Range = tbb::blocked_range<std::size_t>;
  const Range all(0, clusters.size(), 4096);
  const Box bounds = tbb::parallel_reduce(
      all, Box{},
      [&](const Range& range, Box box) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) box = extend(box, clusters[i].box);
        return box;
      },
      [](const Box& a, const Box& b) { return extend(a, b); });
  std::vector<KeyedLight> order(clusters.size());
  tbb::parallel_for(all, [&](const Range& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      order[i] = {light_key(clusters[i].box.lo, clusters[i].cone.axis, bounds, layout), static_cast<std::uint32_t>(i)};
  });
  tbb::parallel_sort(order.begin(), order.end(), [](const KeyedLight& a, const KeyedLight& b) {
    return a.key < b.key || (a.key == b.key && a.light < b.light);
  });
  return order;
}

MergeTree build_morton(const LeafClusters& leaves, const LightKeyLayout& layout) {
  const std::vector<KeyedLight> order = sort_by_key(leaves.clusters, layout);
  const std::size_t n = order.size();
  // Length of the prefix that neighbours share; equal keys go on with their places.
  const auto shared_prefix = [&](std::size_t i) {
    if (i + 1 >= n) return -1;
    const std::uint64_t differing = order[i].key ^ order[i + 1].key;
    return differing != 0 ? std::countl_zero(differing)
                          : 64 + std::countl_zero(static_cast<std::uint64_t>(i ^ (i + 1)));
  };

  // One pass from the left: a subtree is complete as soon as the next light shares less with it than its parts share.
  struct Open {
    std::uint32_t cluster;
    int prefix;  ///< shared with what follows
  };
  MergeTree tree;
  tree.children.reserve(n - 1);
  std::vector<Open> open;
  for (std::size_t i = 0; i < n; ++i) {
    open.push_back({order[i].light, shared_prefix(i)});
    while (open.size() > 1 && open[open.size() - 2].prefix > open.back().prefix) {
      const Open right = open.back();
      open.pop_back();
      tree.children.push_back({open.back().cluster, right.cluster});
      open.back() = {static_cast<std::uint32_t>(n + tree.children.size() - 1), right.prefix};
    }
  }
  return tree;
}

}  // namespace lightcuts
