#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "backend/light_tree.h"
#include "kernels/light_cluster.h"
#include "kernels/light_key.h"
#include "kernels/ploc_pair.h"
#include "lightcuts/lights.h"

namespace lightcuts {

// The locally ordered builder of light trees over an executor (see serial_executor.h): the same clusters, order, search
// and draws as the CPU's (src/cpu/tree/ploc.h), as kernels that a GPU runs. Nothing depends on timing: ids come from
// prefix sums, ties from positions, a representative from the lights below.
// Source: Meister, Bittner 2018, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction".

/// Choices of the builder; docs/results/tree.md says how they were made.
struct LightTreeBuild {
  MetricScale scale;
  std::uint64_t seed = 1;
  std::uint32_t radius = 8;             ///< neighbours searched to each side, at most kLargestPlocRadius
  std::uint32_t search_all_below = 32;  ///< so few clusters each look at all others: nearly the greedy result
  LightKeyLayout layout;
};

/// What all lights have in common.
struct LightSummary {
  Box bounds;           ///< of positions, or of unit directions towards directional lights
  float brightest = 0;  ///< luminance

  /// Darkest light of a metric: dark lights too are clustered by place. It changes no sum.
  [[nodiscard]] LC_FN float luminance_floor() const {
    return brightest > 0 ? max_of(brightest * 1e-20f, 1e-30f) : 1.0f;
  }
};

LC_FN LightNode leaf_of(const Vpl& light, std::uint32_t index) {
  return {{light.position, light.position}, light.axis, 1, light.intensity, index, kNone, 1};
}
LC_FN LightNode leaf_of(const PointLight& light, std::uint32_t index) {
  const bool spot = light.cos_outer >= -1;
  return {{light.position, light.position},
          spot ? light.axis : Vec3{0, 0, 1},
          spot ? light.cos_outer : -1.0f,
          light.intensity,
          index,
          kNone,
          1};
}
LC_FN LightNode leaf_of(const DirectionalLight& light, std::uint32_t index) {
  const Vec3 towards = -light.direction;
  return {{towards, towards}, Vec3{0, 0, 1}, -1, light.irradiance, index, kNone, 1};
}

namespace detail {

/// What a node under construction has beside what cuts need. 24 bytes.
struct NodeMaking {
  Vec3 rest;  ///< what rounding took from the summed intensity: long chains stay exact
  std::uint32_t smallest_light, largest_light;
  std::uint32_t height;  ///< a leaf: 1
};

/// Where a merged node that has a parent hangs: its descendants start `step` places behind where its parent's do.
struct NodeParent {
  std::uint32_t id, step;
};

/// The children of a merged node, the one that carries the representative first.
struct NodeChildren {
  std::uint32_t first, second;
};

/// Two nodes as one, before it has an id.
struct MergedNode {
  LightNode node;
  NodeMaking making;
  NodeChildren children;
  std::uint32_t first_leaves;  ///< of the first child
  bool first_block_first;      ///< of the children's blocks
};

/// Nodes by id: leaves 0 to n - 1 in the order of the curve, then the merged ones in the order of their making.
struct NodesMaking {
  LightNode* nodes;
  NodeMaking* more;        ///< of merged node k; a leaf's follows from its node
  NodeParent* parents;     ///< of merged node k
  NodeChildren* children;  ///< of merged node k
  MetricScale scale;
  const LightSummary* summary;
  std::uint64_t seed;
  std::uint32_t leaf_count;

  [[nodiscard]] LC_KERNEL LightCluster cluster(std::uint32_t id) const {
    const LightNode& n = nodes[id];
    const bool colored = scale.metric == Metric::distance_color || scale.metric == Metric::distance_color_direction;
    return {n.box,
            {n.axis, n.cos_half_angle},
            n.intensity,
            colored ? chromaticity(n.intensity) : Chromaticity{},
            max_of(luminance(n.intensity), summary->luminance_floor())};
  }

  [[nodiscard]] LC_KERNEL NodeMaking making_of(std::uint32_t id, const LightNode& node) const {
    if (id >= leaf_count) return more[id - leaf_count];
    return {{}, node.representative, node.representative, 1};
  }

  LC_KERNEL static void add_exactly(float& sum, float& rest, float sum_p, float rest_p, float sum_q, float rest_q) {
    const double exact = (static_cast<double>(sum_p) + rest_p) + (static_cast<double>(sum_q) + rest_q);
    sum = static_cast<float>(exact);
    rest = static_cast<float>(exact - sum);
  }

  /// p and q as one, p being the lower one in the array.
  [[nodiscard]] LC_KERNEL MergedNode combine(std::uint32_t p_id, std::uint32_t q_id) const {
    const LightNode p = nodes[p_id], q = nodes[q_id];
    const NodeMaking mp = making_of(p_id, p), mq = making_of(q_id, q);
    MergedNode merged;
    LightNode& node = merged.node;
    NodeMaking& making = merged.making;
    node.box = extend(p.box, q.box);
    const DirectionCone cone = unite(DirectionCone{p.axis, p.cos_half_angle}, DirectionCone{q.axis, q.cos_half_angle});
    node.axis = cone.axis;
    node.cos_half_angle = cone.cos_half_angle;
    add_exactly(node.intensity.x, making.rest.x, p.intensity.x, mp.rest.x, q.intensity.x, mq.rest.x);
    add_exactly(node.intensity.y, making.rest.y, p.intensity.y, mp.rest.y, q.intensity.y, mq.rest.y);
    add_exactly(node.intensity.z, making.rest.z, p.intensity.z, mp.rest.z, q.intensity.z, mq.rest.z);
    making.smallest_light = min_of(mp.smallest_light, mq.smallest_light);
    making.largest_light = max_of(mp.largest_light, mq.largest_light);
    making.height = 1 + max_of(mp.height, mq.height);
    node.leaf_count = p.leaf_count + q.leaf_count;

    // Of the children, the one with the lowest light stands first in the draw.
    const bool p_lower = mp.smallest_light < mq.smallest_light;
    const double of_p = luminance(p.intensity), of_q = luminance(q.intensity);
    const double random = representative_random(seed, making.smallest_light, making.largest_light, node.leaf_count);
    const bool lower_wins = p_lower ? first_represents(of_p, of_q, random) : first_represents(of_q, of_p, random);
    const bool p_wins = lower_wins == p_lower;
    node.representative = p_wins ? p.representative : q.representative;
    node.first_child = p_wins ? p_id : q_id;
    merged.children = {p_wins ? p_id : q_id, p_wins ? q_id : p_id};
    // The smaller one's block comes first; of equal ones that of the lower one in the array.
    merged.first_block_first = (p.leaf_count <= q.leaf_count) == p_wins;
    merged.first_leaves = p_wins ? p.leaf_count : q.leaf_count;
    return merged;
  }

  /// Makes it node `id`.
  LC_KERNEL void put(std::uint32_t id, const MergedNode& merged) const {
    nodes[id] = merged.node;
    more[id - leaf_count] = merged.making;
    children[id - leaf_count] = merged.children;
    const std::uint32_t leaves = merged.first_leaves, others = merged.node.leaf_count - leaves;
    const std::uint32_t first = merged.children.first, second = merged.children.second;
    if (first >= leaf_count) parents[first - leaf_count] = {id, merged.first_block_first ? 2 : 2 * others};
    if (second >= leaf_count) parents[second - leaf_count] = {id, merged.first_block_first ? 2 * leaves : 2};
  }
};

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

/// Executors that merge in launches of their own: merge_clusters(making, ids, radius, search_all_below) does what the
/// rounds below do, to the bit.
template <class Exec>
concept MergesItself = requires(Exec& exec, const NodesMaking& making,
                                typename Exec::template Buffer<std::uint32_t>& ids) {
  exec.merge_clusters(making, ids, 8u, 256u);
};

}  // namespace detail

/// A tree over one kind of light in an executor's memory.
template <class Exec>
struct BuiltLightTree {
  typename Exec::template Buffer<LightNode> storage;
  std::uint32_t leaf_count = 0, depth = 0;

  [[nodiscard]] std::uint32_t node_count() const { return leaf_count == 0 ? 0 : 2 * leaf_count - 1; }
  /// Node 0 stands one place in, so that siblings share an aligned pair of cache lines.
  [[nodiscard]] const LightNode* nodes() const { return leaf_count == 0 ? nullptr : storage.data() + 1; }
};

/// Most lights of one kind: ids of merged nodes keep their top bit free.
inline constexpr std::uint32_t kMostTreeLights = (1u << 30) - 1;

/// Most that building holds at once for each light, the lights not included, the tree included [bytes].
inline constexpr std::uint64_t kTreeBuildBytes =
    2 * 2 * sizeof(LightNode) + sizeof(detail::NodeMaking) + 2 * sizeof(detail::NodeParent) + 32;

namespace detail {

/// Merges all clusters.
template <class Exec>
void merge_in_rounds(Exec& exec, const NodesMaking& making, typename Exec::template Buffer<std::uint32_t>& ids,
                     std::uint32_t radius, std::uint32_t search_all_below) {
  const std::uint32_t count = making.leaf_count;
  std::uint32_t new_id = count;
  auto next_ids = exec.template allocate<std::uint32_t>(count);
  auto offsets = exec.template allocate<std::int32_t>(count);
  auto flags = exec.template allocate<std::uint64_t>(count);
  auto places = exec.template allocate<std::uint64_t>(count);
  auto found = exec.template allocate<RankedPartner>(std::size_t{min_of(count, search_all_below)} * kSearchParts);
  int reluctance = 0;  // rounds before that merged hardly anything
  for (std::uint32_t live = count; live > 1;) {
    if (live <= search_all_below) {
      exec.for_each(live * kSearchParts, FindAmongAll{making, ids.data(), found.data(), live});
      exec.for_each(live, JoinSearch{found.data(), offsets.data()});
    } else {
      exec.for_each(live, FindPartners{making, ids.data(), offsets.data(), live, radius});
    }
    if (reluctance > 0) exec.for_each(live / 2, PairNeighbours{offsets.data(), live, reluctance > 1});
    exec.for_each(live, MarkMerges{offsets.data(), flags.data()});
    const std::uint64_t total = exec.exclusive_scan(flags.data(), places.data(), live);
    exec.for_each(live,
                  MergePairs{making, ids.data(), offsets.data(), flags.data(), places.data(), next_ids.data(), new_id});
    std::swap(ids, next_ids);
    const auto merged = static_cast<std::uint32_t>(total >> 32);
    reluctance = reluctance_after(reluctance, live, merged, search_all_below);
    new_id += merged;
    live = static_cast<std::uint32_t>(total);
  }
}

}  // namespace detail

/// Builds the tree over `count` lights, at most kMostTreeLights. Deterministic: the same for any executor, but for the
/// rounding of a compiler that contracts operations.
template <class Exec, class Light>
BuiltLightTree<Exec> build_light_tree(Exec& exec, const Light* lights, std::uint32_t count,
                                      const LightTreeBuild& options) {
  using namespace detail;
  BuiltLightTree<Exec> tree;
  tree.leaf_count = count;
  if (count == 0) return tree;

  auto summary = exec.template allocate<LightSummary>(1);
  if constexpr (requires { exec.summarise(lights, count, summary.data()); }) {
    exec.summarise(lights, count, summary.data());
  } else {
    exec.for_each(1, SummariseLights<Light>{lights, summary.data(), count});
  }

  const std::uint32_t node_count = 2 * count - 1, radius = clamp_to(options.radius, 1u, kLargestPlocRadius);
  auto by_id = exec.template allocate<LightNode>(node_count);
  auto more = exec.template allocate<NodeMaking>(count);
  auto parents = exec.template allocate<NodeParent>(count);
  auto children = exec.template allocate<NodeChildren>(count);
  const NodesMaking making{by_id.data(),  more.data(),    parents.data(), children.data(),
                           options.scale, summary.data(), options.seed,   count};
  auto ids = exec.template allocate<std::uint32_t>(count);
  {
    const KeyPacking packing = pack_keys(count);
    auto keys = exec.template allocate<std::uint64_t>(count);
    exec.for_each(count, KeyLights<Light>{lights, summary.data(), options.layout, packing, keys.data()});
    exec.sort_words(keys, packing.index_bits, packing.index_bits + packing.key_bits);
    exec.for_each(count, MakeLeaves<Light>{lights, keys.data(), packing, making, ids.data()});
  }
  tree.storage = exec.template allocate<LightNode>(std::size_t{node_count} + 1);
  if constexpr (MergesItself<Exec>) {
    exec.merge_clusters(making, ids, radius, options.search_all_below);
  } else {
    merge_in_rounds(exec, making, ids, radius, options.search_all_below);
  }
  if (count == 1) {
    exec.for_each(1, PlaceLeaf{making, tree.storage.data() + 1});
    tree.depth = 1;
    return tree;
  }
  if constexpr (requires { exec.place(making, tree.storage.data()); }) {
    exec.place(making, tree.storage.data() + 1);
  } else {
    exec.for_each(count - 1, PlaceChildren{making, tree.storage.data() + 1});
  }
  tree.depth = exec.fetch(more.data() + (count - 2)).height;
  return tree;
}

}  // namespace lightcuts
