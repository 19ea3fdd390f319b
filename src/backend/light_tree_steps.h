#pragma once

#include <cstdint>

#include "backend/light_tree_nodes.h"
#include "kernels/light_key.h"

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
    // With the usual layout known to the compiler there is no loop.
    constexpr LightKeyLayout kUsual;
    const std::uint64_t key = (layout == kUsual ? light_key(leaf.box.lo, leaf.axis, summary->bounds, kUsual)
                                                : light_key(leaf.box.lo, leaf.axis, summary->bounds, layout)) >>
                              dropped;
    keys[i] = (key << packing.index_bits) | i;
  }
};

template <class Light>
struct MakeLeaves {
  const Light* lights;
  const std::uint64_t* keys;
  KeyPacking packing;
  NodesMaking making;
  [[nodiscard]] LC_KERNEL LightNode leaf(std::uint32_t i) const {
    const auto light = static_cast<std::uint32_t>(keys[i] & ((std::uint64_t{1} << packing.index_bits) - 1));
    return leaf_of(lights[light], light);
  }
  LC_KERNEL void operator()(std::uint32_t i) const { making.nodes[i] = leaf(i); }
};

// --- The order in memory ---

/// Where a merged node's children belong.
struct ChildPlaces {
  std::uint32_t id[2];
  std::uint32_t block;           ///< place of the first; the second follows
  std::uint32_t first_child[2];  ///< of each, kNone: a leaf
};

/// Of merged node k. It is no farther from the root than there were rounds, so that each can find its own way up.
///
/// @param root  the root's id
LC_KERNEL ChildPlaces child_places(const NodesMaking& making, std::uint32_t root, std::uint32_t k) {
  ChildPlaces places;
  places.block = 1;
  for (std::uint32_t at = k; at + making.leaf_count != root;) {
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
  const TreeRoot* root;
  LightNode* placed;

  LC_KERNEL void operator()(std::uint32_t k) const {
    const ChildPlaces places = child_places(making, root->id, k);
    for (std::uint32_t c = 0; c < 2; ++c) {
      LightNode node = making.nodes[places.id[c]];
      node.first_child = places.first_child[c];
      placed[places.block + c] = node;
    }
    if (k == 0) place_root();
  }
  LC_KERNEL void place_root() const {
    LightNode node = making.nodes[root->id];
    node.first_child = 1;
    placed[0] = node;
  }
};

/// A tree of one light.
struct PlaceLeaf {
  NodesMaking making;
  LightNode* placed;
  LC_KERNEL void operator()(std::uint32_t) const { placed[0] = making.nodes[0]; }
};

}  // namespace lightcuts::detail
