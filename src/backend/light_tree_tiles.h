#pragma once

#include <cmath>
#include <cstdint>

#include "backend/light_tree_nodes.h"
#include "kernels/ploc_pair.h"

namespace lightcuts::detail {

// How build_light_tree.h merges clusters: tile by tile along the curve. A tile is few enough clusters for a block of a GPU
// to hold them all; it merges its own in rounds of locally ordered clustering until 16 are left, and asks nobody. What
// neighbouring tiles left is a tile of the next pass, and so on, until one tile is left, which becomes the root. So clusters
// at a tile's edge find no partner beyond it, but only for one pass; cuts grow by hardly 1 % (docs/results/gpu.md), and
// nothing waits for the number of clusters that are left elsewhere.
//
// Every cluster has the name of one of its leaves: a leaf its own, a merged one that of its lower part. The other part's
// name is no longer used, and says the merged node's id: leaf_count - 1 + name. So ids need no counting.

inline constexpr std::uint32_t kLeafTile = 256, kUpperTile = 512;  ///< clusters at most, in the first pass and later
inline constexpr std::uint32_t kTileLeaves = 16;                   ///< that a tile leaves at most to the next pass
inline constexpr std::uint32_t kTilesJoined = kUpperTile / kTileLeaves;

/// So few clusters look at all others.
inline constexpr std::uint32_t kSearchAllBelow = kLargestPlocRadius + 1;

struct LiveCluster {
  std::uint32_t id, name;
};

/// All tiles' merging, one pass.
struct TilePass {
  NodesMaking making;
  const LiveCluster* from;           ///< kTileLeaves places for each tile of the pass before; nullptr: leaves
  const std::uint32_t* from_counts;  ///< clusters that it left
  LiveCluster* to;
  std::uint32_t* to_counts;
  TreeRoot* root;        ///< written by the last tile of all
  std::uint32_t count;   ///< leaves, or tiles of the pass before
  std::uint32_t radius;  ///< neighbours searched to each side, at most kLargestPlocRadius
  std::uint32_t tile_count;

  [[nodiscard]] LC_FN std::uint32_t goal() const { return tile_count == 1 ? 1 : kTileLeaves; }
};

/// Runs `merge(pass)` for each pass over the tree's leaves.
template <class Exec, class Merge>
void for_each_tile_pass(Exec& exec, const NodesMaking& making, std::uint32_t radius, std::uint32_t upper_radius,
                        TreeRoot* root, const Merge& merge) {
  const auto tiles_of = [](std::uint32_t n, std::uint32_t each) { return n / each + (n % each != 0 ? 1 : 0); };
  TilePass pass{making, nullptr, nullptr, nullptr, nullptr, root, making.leaf_count, radius, 0};
  pass.tile_count = tiles_of(making.leaf_count, kLeafTile);
  auto clusters = exec.template allocate<LiveCluster>(std::size_t{2} * kTileLeaves * pass.tile_count);
  auto counts = exec.template allocate<std::uint32_t>(std::size_t{2} * pass.tile_count);
  const std::size_t half = pass.tile_count;
  for (bool upper = false;; upper = !upper) {
    pass.to = clusters.data() + (upper ? kTileLeaves * half : 0);
    pass.to_counts = counts.data() + (upper ? half : 0);
    merge(static_cast<const TilePass&>(pass));
    if (pass.tile_count == 1) return;
    pass.from = pass.to;
    pass.from_counts = pass.to_counts;
    pass.count = pass.tile_count;
    pass.radius = upper_radius;
    pass.tile_count = tiles_of(pass.count, kTilesJoined);
  }
}

/// A cluster, and what its pairs need of it again and again.
struct SizedCluster {
  LightCluster cluster;
  float sine;  ///< of the cone's half angle
};

LC_KERNEL SizedCluster sized(const LightCluster& cluster) {
  return {cluster, lightcuts::detail::sine_of(cluster.cone.cos_half_angle)};
}

/// A root, right to the last bit; hardly anything has none. On a GPU without the detour that others take at zero.
LC_KERNEL float quick_root(float v) {
#ifdef __CUDA_ARCH__
  float inverse;
  asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(inverse) : "f"(v));
  const float near = v * inverse;
  const float root = __fmaf_rn(__fmaf_rn(-near, near, v), 0.5f * inverse, near);
#else
  const float root = std::sqrt(v);
#endif
  return v > 1e-30f ? root : 0.0f;
}

/// Of numbers: a GPU's own operation, where max_of and min_of are two.
LC_KERNEL float greatest(float a, float b) {
#ifdef __CUDA_ARCH__
  return fmaxf(a, b);
#else
  return max_of(a, b);
#endif
}
LC_KERNEL float least(float a, float b) { return -greatest(-a, -b); }

/// united_cosine in fewer steps: whether one cone holds the other need not be asked, for then half of the sum of all
/// angles is no wider than the wide cone.
LC_KERNEL float pair_cosine(const DirectionCone& p, float p_sine, const DirectionCone& q, float q_sine) {
  const Vec3 chord = p.axis - q.axis;
  const float apart = least(0.25f * dot(chord, chord), 1.0f);  // the squared sine of half the angle of the axes
  const float cos_axes = 1 - 2 * apart, sin_axes = 2 * quick_root(apart * (1 - apart));
  const float cos_p = p.cos_half_angle, cos_q = q.cos_half_angle;
  const float cos_both = cos_p * cos_q - p_sine * q_sine, sin_both = p_sine * cos_q + cos_p * q_sine;
  const float cos_full = cos_axes * cos_both - sin_axes * sin_both;
  const float sin_full = sin_axes * cos_both + cos_axes * sin_both;
  const float half = quick_root(0.5f + 0.5f * cos_full);
  const bool past_pi = sin_full < 0, everything = (sin_both < 0) & !past_pi;
  const float open = least(past_pi ? -half : half, least(cos_p, cos_q));
  return everything ? -1.0f : open;
}

/// cluster_size of both, but for rounding.
LC_KERNEL float pair_size(const SizedCluster& p, const SizedCluster& q, const MetricScale& scale) {
  if (scale.metric != Metric::walter || !(scale.direction_extent_sq > 0)) {
    return cluster_size(p.cluster, q.cluster, scale);
  }
  const Box &a = p.cluster.box, &b = q.cluster.box;
  const Vec3 extent{greatest(a.hi.x, b.hi.x) - least(a.lo.x, b.lo.x), greatest(a.hi.y, b.hi.y) - least(a.lo.y, b.lo.y),
                    greatest(a.hi.z, b.hi.z) - least(a.lo.z, b.lo.z)};
  const float cos_beta = pair_cosine(p.cluster.cone, p.sine, q.cluster.cone, q.sine);
  return walter_size(p.cluster.luminance + q.cluster.luminance, dot(extent, extent), cos_beta,
                     scale.direction_extent_sq);
}

/// Pairs neighbours if one of both wants, or whether they want or not: where each prefers the next (lights in a row, ever
/// brighter) hardly any choose each other.
template <class Offset>
LC_KERNEL void pair_neighbours(Offset* two, bool whether_they_want_or_not) {
  if (!whether_they_want_or_not && two[0] != 1 && two[1] != -1) return;
  two[0] = 1;
  two[1] = -1;
}

/// How reluctant clusters were to merge, 0 to 2, after a round that merged so many of them.
LC_FN int reluctance_after(int before, std::uint32_t live, std::uint32_t merged) {
  return live > kSearchAllBelow && merged < live / 64 ? min_of(before + 1, 2) : 0;
}

/// Merges the clusters of one tile, on one thread: what a GPU's block does is the same to the bit.
class MergeTile {
 public:
  explicit MergeTile(const TilePass& pass) : pass_(pass) {}

  void operator()(std::uint32_t tile) const {
    Tile t;
    load(tile, t);
    int reluctance = 0;
    while (t.live > pass_.goal()) {
      const std::uint32_t before = t.live;
      choose(t);
      for (std::uint32_t i = 0; reluctance > 0 && i + 1 < t.live; i += 2) {
        pair_neighbours(t.offset + i, reluctance > 1);
      }
      merge(t);
      reluctance = reluctance_after(reluctance, before, before - t.live);
    }
    leave(tile, t);
  }

 private:
  struct Tile {
    std::uint32_t live = 0;
    LiveCluster of[kUpperTile];
    SizedCluster clusters[kUpperTile];
    std::int32_t offset[kUpperTile];
  };

  void add(Tile& t, LiveCluster one) const {
    t.of[t.live] = one;
    t.clusters[t.live++] = sized(pass_.making.cluster(pass_.making.nodes[one.id]));
  }

  void load(std::uint32_t tile, Tile& t) const {
    if (pass_.from == nullptr) {
      const std::uint32_t begin = tile * kLeafTile, end = min_of(begin + kLeafTile, pass_.count);
      for (std::uint32_t i = begin; i < end; ++i) add(t, {i, i});
      return;
    }
    const std::uint32_t begin = tile * kTilesJoined, end = min_of(begin + kTilesJoined, pass_.count);
    for (std::uint32_t g = begin; g < end; ++g) {
      for (std::uint32_t k = 0; k < pass_.from_counts[g]; ++k) add(t, pass_.from[g * kTileLeaves + k]);
    }
  }

  /// How far up or down the array each cluster's best partner is.
  void choose(Tile& t) const {
    float up[kUpperTile], down[kUpperTile];
    for (std::uint32_t i = 0; i < t.live; ++i) up[i] = down[i] = kInfinity;
    const std::uint32_t radius = t.live <= kSearchAllBelow ? kLargestPlocRadius : pass_.radius;
    for (std::uint32_t i = 0; i < t.live; ++i) {
      for (std::uint32_t k = 1; k <= radius && i + k < t.live; ++k) {
        const float rank = ploc_rank(pair_size(t.clusters[i], t.clusters[i + k], pass_.making.scale), i, k);
        up[i] = min_of(up[i], rank);
        down[i + k] = min_of(down[i + k], rank);
      }
      t.offset[i] = ploc_offset(up[i], down[i], i);
    }
  }

  /// Merges those that chose each other, and closes the gaps.
  void merge(Tile& t) const {
    const std::uint32_t count = t.live;
    std::int32_t offset[kUpperTile];
    for (std::uint32_t i = 0; i < count; ++i) offset[i] = t.offset[i];
    t.live = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t j = i + static_cast<std::uint32_t>(offset[i]);
      const bool pairs = offset[j] == -offset[i];
      if (!pairs) {
        t.of[t.live] = t.of[i];
        t.clusters[t.live++] = t.clusters[i];
      } else if (offset[i] > 0) {
        add(t, merge(t.of[i], t.of[j]));
      }
    }
  }

  [[nodiscard]] LiveCluster merge(LiveCluster a, LiveCluster b) const {
    const NodesMaking& making = pass_.making;
    const LightNode &p = making.nodes[a.id], &q = making.nodes[b.id];
    const std::uint32_t id = making.leaf_count - 1 + b.name;
    making.put(id, NodesMaking::merge_shapes(p.box, {p.axis, p.cos_half_angle}, q.box, {q.axis, q.cos_half_angle}));
    making.put(id, making.merge_sums(a.id, p, making.making_of(a.id, p), b.id, q, making.making_of(b.id, q)));
    return {id, a.name};
  }

  void leave(std::uint32_t tile, const Tile& t) const {
    for (std::uint32_t i = 0; i < t.live; ++i) pass_.to[tile * kTileLeaves + i] = t.of[i];
    pass_.to_counts[tile] = t.live;
    if (pass_.tile_count > 1) return;
    const std::uint32_t id = t.of[0].id;
    *pass_.root = {id, pass_.making.making_of(id, pass_.making.nodes[id]).height};
  }

  TilePass pass_;
};

}  // namespace lightcuts::detail
