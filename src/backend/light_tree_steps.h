#pragma once

#include <cstdint>

#include "backend/light_tree_nodes.h"
#include "kernels/light_key.h"
#include "kernels/ploc_pair.h"

// What build_light_tree.h does for each light, cluster or node: one struct a launch.

namespace lightcuts::detail {

// --- What leaves have in common, and their order ---

template <class Light>
struct SummariseLights {
  const Light* lights;
  LightSummary* summary;
  std::uint32_t count;
  LC_KERNEL void operator()(std::uint32_t) const {
    LightSummary all;
    for (std::uint32_t i = 0; i < count; ++i) {
      const LightNode leaf = leaf_of(lights[i], i);
      all = {extend(all.bounds, leaf.box), max_of(all.brightest, luminance(leaf.intensity))};
    }
    *summary = all;
  }
};

/// How a sorting key shares its word with the light's index, which stands in the low bits: one word sorts and says which.
struct KeyPacking {
  int index_bits, key_bits;
};

/// A light's place on a 2048th of the scene's longest side. (Forty bits, a 256th: cuts 5 % larger on `cornell`.)
inline constexpr int kTreeKeyBits = 48;

LC_FN KeyPacking pack_keys(std::uint32_t count) {
  int index_bits = 1;
  while (index_bits < 32 && ((count - 1) >> index_bits) != 0) ++index_bits;
  return {index_bits, min_of(kTreeKeyBits, 64 - index_bits)};
}

template <class Light>
struct KeyLights {
  const Light* lights;
  const LightSummary* summary;
  LightKeyLayout layout;
  KeyPacking packing;
  std::uint64_t* keys;
  LC_KERNEL void operator()(std::uint32_t i) const {
    const LightNode leaf = leaf_of(lights[i], i);
    const int all_bits = 3 * (layout.position_bits + layout.direction_bits);
    const int dropped = max_of(all_bits - packing.key_bits, 0);
    const std::uint64_t key = light_key(leaf.box.lo, leaf.axis, summary->bounds, layout) >> dropped;
    keys[i] = (key << packing.index_bits) | i;
  }
};

template <class Light>
struct MakeLeaves {
  const Light* lights;
  const std::uint64_t* keys;
  KeyPacking packing;
  NodesMaking making;
  std::uint32_t* ids;
  LC_KERNEL void operator()(std::uint32_t i) const {
    const auto light = static_cast<std::uint32_t>(keys[i] & ((std::uint64_t{1} << packing.index_bits) - 1));
    making.nodes[i] = leaf_of(lights[light], light);
    ids[i] = i;
  }
};

// --- A round ---

/// A cluster, and what its pairs need of it again and again.
struct SizedCluster {
  LightCluster cluster;
  float sine;  ///< of the cone's half angle
};

LC_KERNEL SizedCluster sized(const LightCluster& cluster) {
  return {cluster, lightcuts::detail::sine_of(cluster.cone.cos_half_angle)};
}

/// cluster_size of both, to the bit.
LC_KERNEL float pair_size(const SizedCluster& p, const SizedCluster& q, const MetricScale& scale) {
  if (scale.metric != Metric::walter || !(scale.direction_extent_sq > 0)) {
    return cluster_size(p.cluster, q.cluster, scale);
  }
  const Vec3 extent = max_of(p.cluster.box.hi, q.cluster.box.hi) - min_of(p.cluster.box.lo, q.cluster.box.lo);
  const DirectionCone &a = p.cluster.cone, &b = q.cluster.cone;
  const float cos_beta = united_cosine(a.axis, a.cos_half_angle, p.sine, b.axis, b.cos_half_angle, q.sine);
  return walter_size(p.cluster.luminance + q.cluster.luminance, dot(extent, extent), cos_beta,
                     scale.direction_extent_sq);
}

/// How far up or down the array each cluster's best partner within `radius` places is.
struct FindPartners {
  NodesMaking making;
  const std::uint32_t* ids;
  std::int32_t* offsets;
  std::uint32_t count, radius;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const SizedCluster own = sized(making.cluster(ids[i]));
    float up = kInfinity, down = kInfinity;
    for (std::uint32_t offset = 1; offset <= radius; ++offset) {
      if (i + offset < count) {
        up = min_of(up, ploc_rank(pair_size(own, sized(making.cluster(ids[i + offset])), making.scale), i, offset));
      }
      if (i >= offset) {
        const float size = pair_size(sized(making.cluster(ids[i - offset])), own, making.scale);
        down = min_of(down, ploc_rank(size, i - offset, offset));
      }
    }
    offsets[i] = ploc_offset(up, down, i);
  }
};

/// Ways in which the search among all clusters is split.
inline constexpr std::uint32_t kSearchParts = 32;

/// A pair's size and the higher place of the two; what is smaller comes first.
struct RankedPartner {
  float size = kInfinity;
  std::uint32_t place = kNone;
};

/// The best partner of each cluster among every kSearchParts-th of all; item i is cluster i / kSearchParts. Ties go to the
/// pair with the lower lower place, then to that with the lower higher one.
struct FindAmongAll {
  NodesMaking making;
  const std::uint32_t* ids;
  RankedPartner* found;
  std::uint32_t count;

  LC_KERNEL void operator()(std::uint32_t item) const {
    const std::uint32_t i = item / kSearchParts;
    const SizedCluster own = sized(making.cluster(ids[i]));
    RankedPartner best;
    for (std::uint32_t j = item % kSearchParts; j < count; j += kSearchParts) {
      if (j == i) continue;
      best = better(i, best, {pair_size(own, sized(making.cluster(ids[j])), making.scale), j});
    }
    found[item] = best;
  }

  LC_FN static RankedPartner better(std::uint32_t i, RankedPartner a, RankedPartner b) {
    if (b.place == kNone) return a;
    if (a.place == kNone || b.size < a.size) return b;
    return b.size == a.size && before(i, b.place, a.place) ? b : a;
  }

  LC_FN static bool before(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    const std::uint32_t lo_j = min_of(i, j), lo_k = min_of(i, k);
    return lo_j != lo_k ? lo_j < lo_k : max_of(i, j) < max_of(i, k);
  }
};

struct JoinSearch {
  const RankedPartner* found;
  std::int32_t* offsets;
  LC_KERNEL void operator()(std::uint32_t i) const {
    RankedPartner best;
    for (std::uint32_t part = 0; part < kSearchParts; ++part)
      best = FindAmongAll::better(i, best, found[i * kSearchParts + part]);
    offsets[i] = static_cast<std::int32_t>(best.place) - static_cast<std::int32_t>(i);
  }
};

/// Pairs neighbours if one of both wants, or whether they want or not: where each prefers the next (lights in a row, ever
/// brighter) hardly any choose each other.
struct PairNeighbours {
  std::int32_t* offsets;
  std::uint32_t count;
  bool whether_they_want_or_not;
  LC_KERNEL void operator()(std::uint32_t pair) const {
    const std::uint32_t i = 2 * pair;
    if (i + 1 < count) apply(offsets + i);
  }
  LC_KERNEL void apply(std::int32_t* two) const {
    if (!whether_they_want_or_not && two[0] != 1 && two[1] != -1) return;
    two[0] = 1;
    two[1] = -1;
  }
};

/// How reluctant clusters were to merge, 0 to 2, after a round that merged so many of them.
LC_FN int reluctance_after(int before, std::uint32_t live, std::uint32_t merged, std::uint32_t search_all_below) {
  return live > search_all_below && merged < live / 64 ? min_of(before + 1, 2) : 0;
}

/// Marks what stays in the array (low half) and what merges (high half), ready for one prefix sum.
struct MarkMerges {
  const std::int32_t* offsets;
  std::uint64_t* flags;
  LC_KERNEL void operator()(std::uint32_t i) const {
    const std::int32_t offset = offsets[i];
    const bool pairs = offsets[static_cast<std::int64_t>(i) + offset] == -offset;
    const bool merges = pairs && offset > 0, stays = !pairs || merges;
    flags[i] = (merges ? std::uint64_t{1} << 32 : 0) | (stays ? 1u : 0u);
  }
};

/// Merges the pairs and writes the closed-up array.
struct MergePairs {
  NodesMaking making;
  const std::uint32_t* ids;
  const std::int32_t* offsets;
  const std::uint64_t* flags;
  const std::uint64_t* places;
  std::uint32_t* next_ids;
  std::uint32_t first_new_id;
  LC_KERNEL void operator()(std::uint32_t i) const {
    const std::uint64_t flag = flags[i], place = places[i];
    if ((flag & 1u) == 0) return;
    std::uint32_t id = ids[i];
    if ((flag >> 32) != 0) {
      const std::uint32_t parent = first_new_id + static_cast<std::uint32_t>(place >> 32);
      making.put(parent, making.combine(id, ids[i + static_cast<std::uint32_t>(offsets[i])]));
      id = parent;
    }
    next_ids[static_cast<std::uint32_t>(place)] = id;
  }
};

// --- The order in memory ---

/// Where a merged node's children belong.
struct ChildPlaces {
  std::uint32_t id[2];
  std::uint32_t block;           ///< place of the first; the second follows
  std::uint32_t first_child[2];  ///< of each, kNone: a leaf
};

/// Of merged node k. It is no farther from the root than there were rounds, so that each can find its own way up.
LC_KERNEL ChildPlaces child_places(const NodesMaking& making, std::uint32_t k) {
  const std::uint32_t root = making.leaf_count - 2;
  ChildPlaces places;
  places.block = 1;
  for (std::uint32_t at = k; at != root;) {
    const NodeParent parent = making.parents[at];
    places.block += parent.step;
    at = parent.id - making.leaf_count;
  }
  const NodeChildren children = making.children[k];
  places.id[0] = children.first;
  places.id[1] = children.second;
  for (int c = 0; c < 2; ++c) {
    const bool leaf = places.id[c] < making.leaf_count;
    places.first_child[c] = leaf ? kNone : places.block + making.parents[places.id[c] - making.leaf_count].step;
  }
  return places;
}

/// Writes the children of a merged node where they belong, and the root.
struct PlaceChildren {
  NodesMaking making;
  LightNode* placed;

  LC_KERNEL void operator()(std::uint32_t k) const {
    const ChildPlaces places = child_places(making, k);
    for (std::uint32_t c = 0; c < 2; ++c) {
      LightNode node = making.nodes[places.id[c]];
      node.first_child = places.first_child[c];
      placed[places.block + c] = node;
    }
    if (k + 2 == making.leaf_count) place_root();
  }
  LC_KERNEL void place_root() const {
    LightNode root = making.nodes[2 * making.leaf_count - 2];
    root.first_child = 1;
    placed[0] = root;
  }
};

/// A tree of one light.
struct PlaceLeaf {
  NodesMaking making;
  LightNode* placed;
  LC_KERNEL void operator()(std::uint32_t) const { placed[0] = making.nodes[0]; }
};

}  // namespace lightcuts::detail
