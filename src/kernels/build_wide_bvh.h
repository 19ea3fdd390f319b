#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "kernels/bits.h"
#include "kernels/morton.h"
#include "kernels/ploc.h"
#include "kernels/scene_view.h"
#include "kernels/wide_bvh.h"

namespace lightcuts {

// Builds a WideBvhView's arrays: Morton order, PLOC into a binary tree, collapse into nodes of eight.
// Every instance's triangles are placed in world space: memory grows with the triangles drawn.

/// Where instance i's triangles begin among all that are drawn.
struct DrawnTriangles {
  SceneView scene;
  const std::uint32_t* instance_begin;  ///< instance_count + 1 entries

  LC_KERNEL LeafTriangle operator()(std::uint32_t drawn) const {
    std::uint32_t lo = 0, hi = scene.instance_count;
    while (hi - lo > 1) {
      const std::uint32_t mid = (lo + hi) / 2;
      if (instance_begin[mid] <= drawn) {
        lo = mid;
      } else {
        hi = mid;
      }
    }
    const InstanceView& instance = scene.instances[lo];
    const MeshView& mesh = scene.meshes[instance.mesh];
    const std::uint32_t local = drawn - instance_begin[lo];
    const std::uint32_t* corners = mesh.triangles[local];
    return {transform_point(instance.world_from_object, mesh.positions[corners[0]]),
            lo,
            transform_point(instance.world_from_object, mesh.positions[corners[1]]),
            local,
            transform_point(instance.world_from_object, mesh.positions[corners[2]]),
            scene.materials[mesh.material].masked ? 1u : 0u};
  }
};

/// Binary tree of boxes as PLOC leaves it; leaves are places in the Morton order.
struct BoxClusters {
  Box* boxes;
  std::uint32_t* left;
  std::uint32_t* right;
  std::uint32_t* leaf_counts;

  LC_FN static float area(const Box& b) {
    const Vec3 e = b.hi - b.lo;
    return e.x * e.y + e.y * e.z + e.z * e.x;
  }
  LC_KERNEL float distance(std::uint32_t a, std::uint32_t b) const { return area(extend(boxes[a], boxes[b])); }
  LC_KERNEL void merge(std::uint32_t parent, std::uint32_t a, std::uint32_t b) const {
    boxes[parent] = extend(boxes[a], boxes[b]);
    left[parent] = a;
    right[parent] = b;
    leaf_counts[parent] = leaf_counts[a] + leaf_counts[b];
  }
};

struct PrepareTriangles {
  DrawnTriangles triangles;
  std::uint64_t* keys;
  std::uint32_t* order;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const LeafTriangle t = triangles(i);
    const Vec3 middle = (min_of(t.p0, min_of(t.p1, t.p2)) + max_of(t.p0, max_of(t.p1, t.p2))) * 0.5f;
    keys[i] = morton_key(triangles.scene.bounds, middle);
    order[i] = i;
  }
};

struct PrepareLeaves {
  DrawnTriangles triangles;
  const std::uint32_t* order;
  BoxClusters clusters;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const LeafTriangle t = triangles(order[i]);
    clusters.boxes[i] = {min_of(t.p0, min_of(t.p1, t.p2)), max_of(t.p0, max_of(t.p1, t.p2))};
    clusters.leaf_counts[i] = 1;
  }
};

/// The up to eight subtrees that become the children of one wide node.
struct Openings {
  std::uint32_t ids[8];
  std::uint32_t count;
};

/// Opens the largest inner subtree until eight are found: the area a ray is most likely to meet goes first.
LC_KERNEL Openings open_subtrees(const BoxClusters& clusters, std::uint32_t root) {
  Openings open{{root}, 1};
  while (open.count < 8) {
    int largest = -1;
    float largest_area = -1;
    for (std::uint32_t c = 0; c < open.count; ++c) {
      if (clusters.leaf_counts[open.ids[c]] <= kLeafTriangles) continue;
      const float area = BoxClusters::area(clusters.boxes[open.ids[c]]);
      if (area > largest_area) {
        largest_area = area;
        largest = static_cast<int>(c);
      }
    }
    if (largest < 0) break;
    const std::uint32_t opened = open.ids[largest];
    open.ids[largest] = clusters.left[opened];
    open.ids[open.count++] = clusters.right[opened];
  }
  return open;
}

/// Counts what a wide node will hold: children that are nodes (high half), triangles in leaves (low half).
struct CountChildren {
  BoxClusters clusters;
  const std::uint32_t* subtrees;
  std::uint64_t* counts;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const Openings open = open_subtrees(clusters, subtrees[i]);
    std::uint64_t nodes = 0, triangles = 0;
    for (std::uint32_t c = 0; c < open.count; ++c) {
      const std::uint32_t leaves = clusters.leaf_counts[open.ids[c]];
      if (leaves > kLeafTriangles) {
        ++nodes;
      } else {
        triangles += leaves;
      }
    }
    counts[i] = nodes << 32 | triangles;
  }
};

/// Largest coordinate of a box, as a measure of how coarse floats are there.
LC_FN float magnitude(const Box& b) {
  const Vec3 m = max_of(max_of(b.hi, -b.hi), max_of(b.lo, -b.lo));
  return max_component(m);
}

/// Smallest e such that 255 * 2^e covers `extent`.
LC_FN int covering_exponent(float extent) {
  const float step = extent / 255.0f;
  const std::uint32_t bits = bits_of(step);
  int e = static_cast<int>(bits >> 23) - 127;
  if ((bits & 0x7fffffu) != 0) ++e;
  return clamp_to(e, -100, 127);
}

LC_FN std::uint8_t quantise(float steps) { return static_cast<std::uint8_t>(clamp_to(steps, 0.0f, 255.0f)); }

/// Writes the wide nodes of one level and what the next level works on.
struct WriteNodes {
  BoxClusters clusters;
  DrawnTriangles triangles;
  const std::uint32_t* order;
  const std::uint32_t* subtrees;
  const std::uint64_t* offsets;
  std::uint32_t* next_subtrees;
  WideNode* nodes;
  LeafTriangle* leaves;
  std::uint32_t level_base, next_base, triangle_base;

  LC_KERNEL void operator()(std::uint32_t i) const {
    const Openings open = open_subtrees(clusters, subtrees[i]);
    const Box box = clusters.boxes[subtrees[i]];
    const std::uint32_t node_offset = static_cast<std::uint32_t>(offsets[i] >> 32);
    const std::uint32_t triangle_offset = static_cast<std::uint32_t>(offsets[i]);
    WideNode node{};
    node.child_base = next_base + node_offset;
    node.triangle_base = triangle_base + triangle_offset;

    // Some ulps of slack: a box may not be lost to the rounding of the ray's distances.
    const float slack = magnitude(box) * 9.6e-7f + max_component(box.hi - box.lo) * 1e-5f + 1e-30f;
    node.origin = box.lo - Vec3{slack, slack, slack} * 2.0f;
    const Vec3 extent = box.hi + Vec3{slack, slack, slack} * 2.0f - node.origin;
    const int ex = covering_exponent(extent.x), ey = covering_exponent(extent.y), ez = covering_exponent(extent.z);
    node.exponent_x = static_cast<std::int8_t>(ex);
    node.exponent_y = static_cast<std::int8_t>(ey);
    node.exponent_z = static_cast<std::int8_t>(ez);
    const Vec3 inverse_step{exp2_int(-ex), exp2_int(-ey), exp2_int(-ez)};

    std::uint32_t slot_of[8];
    assign_slots(open, center(box), slot_of);
    std::uint32_t child_at[8];
    for (int s = 0; s < 8; ++s) {
      child_at[s] = kNone;
      node.lo_x[s] = node.lo_y[s] = node.lo_z[s] = 255;
    }
    for (std::uint32_t c = 0; c < open.count; ++c) child_at[slot_of[c]] = open.ids[c];

    std::uint32_t inner = 0, triangle = 0;
    for (int s = 0; s < 8; ++s) {
      const std::uint32_t id = child_at[s];
      if (id == kNone) continue;
      const Box b = clusters.boxes[id];
      const Vec3 lo = (b.lo - Vec3{slack, slack, slack} - node.origin) * inverse_step;
      const Vec3 hi = (b.hi + Vec3{slack, slack, slack} - node.origin) * inverse_step;
      node.lo_x[s] = quantise(floor_of(lo.x));
      node.lo_y[s] = quantise(floor_of(lo.y));
      node.lo_z[s] = quantise(floor_of(lo.z));
      node.hi_x[s] = quantise(-floor_of(-hi.x));
      node.hi_y[s] = quantise(-floor_of(-hi.y));
      node.hi_z[s] = quantise(-floor_of(-hi.z));
      const std::uint32_t count = clusters.leaf_counts[id];
      if (count > kLeafTriangles) {
        node.node_mask = static_cast<std::uint8_t>(node.node_mask | 1u << s);
        next_subtrees[node_offset + inner++] = id;
      } else {
        node.meta[s] = static_cast<std::uint8_t>(triangle << 2 | count);
        triangle += write_leaf(id, node.triangle_base + triangle);
      }
    }
    nodes[level_base + i] = node;
  }

  /// floor without the library call, exact for the range of quantised steps.
  LC_FN static float floor_of(float v) {
    const float truncated = static_cast<float>(static_cast<int>(clamp_to(v, -1e6f, 1e6f)));
    return truncated > v ? truncated - 1 : truncated;
  }

  /// Gives each child the slot whose corner of the box it lies nearest to, the best pair first.
  LC_KERNEL void assign_slots(const Openings& open, Vec3 middle, std::uint32_t* slot_of) const {
    float cost[8][8];
    for (std::uint32_t c = 0; c < open.count; ++c) {
      const Vec3 d = center(clusters.boxes[open.ids[c]]) - middle;
      for (int s = 0; s < 8; ++s) cost[c][s] = (s & 1 ? d.x : -d.x) + (s & 2 ? d.y : -d.y) + (s & 4 ? d.z : -d.z);
    }
    std::uint32_t children_left = (1u << open.count) - 1, slots_left = 0xffu;
    while (children_left != 0) {
      int best_child = -1, best_slot = -1;
      for (int c = 0; c < static_cast<int>(open.count); ++c) {
        if (!(children_left >> c & 1u)) continue;
        for (int s = 0; s < 8; ++s) {
          if (!(slots_left >> s & 1u)) continue;
          if (best_child < 0 || cost[c][s] > cost[best_child][best_slot]) {
            best_child = c;
            best_slot = s;
          }
        }
      }
      slot_of[best_child] = static_cast<std::uint32_t>(best_slot);
      children_left &= ~(1u << best_child);
      slots_left &= ~(1u << best_slot);
    }
  }

  /// Writes a leaf slot's triangles; at most kLeafTriangles, so the walk below it is three nodes deep.
  LC_KERNEL std::uint32_t write_leaf(std::uint32_t id, std::uint32_t at) const {
    std::uint32_t pending[kLeafTriangles] = {id, 0, 0};
    int depth = 1;
    std::uint32_t written = 0;
    while (depth > 0) {
      const std::uint32_t top = pending[--depth];
      if (clusters.leaf_counts[top] == 1) {
        leaves[at + written++] = triangles(order[top]);
      } else {
        pending[depth++] = clusters.right[top];
        pending[depth++] = clusters.left[top];
      }
    }
    return written;
  }
};

/// Arrays behind a WideBvhView, in the executor's memory.
template <class Exec>
struct WideBvh {
  typename Exec::template Buffer<WideNode> nodes;
  typename Exec::template Buffer<LeafTriangle> triangles;
  std::uint32_t node_count = 0;
  std::uint32_t depth = 0;

  [[nodiscard]] WideBvhView view() const { return {node_count == 0 ? nullptr : nodes.data(), triangles.data()}; }
};

/// Builds the tree over everything that `scene` draws. `instance_begin` is the host's prefix sum of the triangles of
/// each instance (instance_count + 1 entries); `scene` points into the executor's memory.
/// Bytes taken while building: about 170 a triangle; afterwards about 75.
template <class Exec>
WideBvh<Exec> build_wide_bvh(Exec& exec, const SceneView& scene, const std::vector<std::uint32_t>& instance_begin,
                             std::uint32_t ploc_radius = 16) {
  WideBvh<Exec> bvh;
  const std::uint32_t n = instance_begin.empty() ? 0 : instance_begin.back();
  if (n == 0) return bvh;
  auto begins = exec.upload(instance_begin.data(), instance_begin.size());
  const DrawnTriangles triangles{scene, begins.data()};

  auto order = exec.template allocate<std::uint32_t>(n);
  {
    auto keys = exec.template allocate<std::uint64_t>(n);
    exec.for_each(n, PrepareTriangles{triangles, keys.data(), order.data()});
    exec.sort_pairs(keys, order);
  }
  auto boxes = exec.template allocate<Box>(2 * std::size_t{n} - 1);
  auto left = exec.template allocate<std::uint32_t>(2 * std::size_t{n} - 1);
  auto right = exec.template allocate<std::uint32_t>(2 * std::size_t{n} - 1);
  auto leaf_counts = exec.template allocate<std::uint32_t>(2 * std::size_t{n} - 1);
  const BoxClusters clusters{boxes.data(), left.data(), right.data(), leaf_counts.data()};
  exec.for_each(n, PrepareLeaves{triangles, order.data(), clusters});
  build_ploc(exec, clusters, n, ploc_radius);

  // A node either has eight children or none that is a node, and then at least four triangles of its own: counting
  // slots bounds the nodes by 2 n / 7.
  bvh.nodes = exec.template allocate<WideNode>(std::size_t{n} / 2 + 1);
  bvh.triangles = exec.template allocate<LeafTriangle>(n);
  const std::uint32_t root = n == 1 ? 0 : 2 * n - 2;
  auto subtrees = exec.upload(&root, 1);
  std::uint32_t level_base = 0, level_count = 1, triangle_base = 0;
  while (level_count > 0) {
    auto counts = exec.template allocate<std::uint64_t>(level_count);
    auto offsets = exec.template allocate<std::uint64_t>(level_count);
    exec.for_each(level_count, CountChildren{clusters, subtrees.data(), counts.data()});
    const std::uint64_t total = exec.exclusive_scan(counts.data(), offsets.data(), level_count);
    const auto next_count = static_cast<std::uint32_t>(total >> 32);
    auto next_subtrees = exec.template allocate<std::uint32_t>(max_of(next_count, 1u));
    exec.for_each(level_count, WriteNodes{clusters, triangles, order.data(), subtrees.data(), offsets.data(),
                                          next_subtrees.data(), bvh.nodes.data(), bvh.triangles.data(), level_base,
                                          level_base + level_count, triangle_base});
    triangle_base += static_cast<std::uint32_t>(total);
    level_base += level_count;
    level_count = next_count;
    subtrees = std::move(next_subtrees);
    ++bvh.depth;
  }
  bvh.node_count = level_base;
  return bvh;
}

}  // namespace lightcuts
