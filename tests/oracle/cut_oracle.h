#pragma once

#include <algorithm>
#include <cstdint>
#include <queue>
#include <vector>

#include "backend/light_tree.h"
#include "kernels/cluster_bound.h"
#include "lightcuts/lights.h"
#include "oracle/cluster_terms.h"

namespace lightcuts::oracle {

/// What the textbook algorithm yields for one point: its cut, unshadowed, in double precision.
struct CutResult {
  std::vector<std::uint32_t> nodes;
  double total = 0;      ///< estimate, luminance of the reflected radiance
  double bound_sum = 0;  ///< of all nodes of the cut
};

/// Point to light, clamp [m], luminance of its albedo.
struct CutPoint {
  Vec3 position, normal;
  double albedo = 1, clamp = 0;
};

/// Geometric bound of a node of VPLs in double precision.
inline double node_bound(const CutPoint& point, const LightNode& node) {
  const LitPoint<double> receiver{{point.position.x, point.position.y, point.position.z},
                                  {point.normal.x, point.normal.y, point.normal.z}};
  return vpl_bound<double>(receiver, node.box, {node.axis, node.cos_half_angle}, point.clamp * point.clamp);
}

/// Refines the node with the largest bound until it is at most `error` of the total, as Walter et al. 2005 write it.
/// @param bound  (point, node) -> bound on the geometric term [1/m^2]; leaves are exact whatever it says
template <class Bound>
CutResult heap_cut(const LightTree& tree, const std::vector<Vpl>& lights, const CutPoint& point, double error,
                   const Bound& bound) {
  struct Entry {
    double bound;
    std::uint32_t node;
    double unit;  ///< geometric term of the representative
    bool operator<(const Entry& other) const { return bound < other.bound; }
  };
  const auto scale = [&](const LightNode& node) {
    return point.albedo / 3.14159265358979323846 *
           (0.2126 * node.intensity.x + 0.7152 * node.intensity.y + 0.0722 * node.intensity.z);
  };
  const auto evaluate = [&](const LightNode& node) {
    const Vpl& light = lights[node.representative];
    return vpl_term(point.position, point.normal, light.position, light.axis, point.clamp);
  };
  std::priority_queue<Entry> heap;
  CutResult result;
  const auto add = [&](std::uint32_t index, double unit) {
    const LightNode& node = tree.nodes[index];
    result.total += scale(node) * unit;
    heap.push({node.is_leaf() ? 0.0 : scale(node) * bound(point, node), index, unit});
  };
  if (tree.nodes.empty()) return result;
  add(0, evaluate(tree.nodes[0]));
  while (heap.top().bound > error * result.total) {
    const Entry top = heap.top();
    heap.pop();
    const LightNode& node = tree.nodes[top.node];
    result.total -= scale(node) * top.unit;
    add(node.first_child, top.unit);
    add(node.second_child(), evaluate(tree.nodes[node.second_child()]));
  }
  result.total = 0;
  while (!heap.empty()) {
    result.nodes.push_back(heap.top().node);
    result.total += scale(tree.nodes[heap.top().node]) * heap.top().unit;
    result.bound_sum += heap.top().bound;
    heap.pop();
  }
  return result;
}

inline CutResult heap_cut(const LightTree& tree, const std::vector<Vpl>& lights, const CutPoint& point, double error) {
  return heap_cut(tree, lights, point, error, node_bound);
}

/// The sum over all lights.
inline double brute_force(const std::vector<Vpl>& lights, const CutPoint& point) {
  double sum = 0;
  for (const Vpl& light : lights) {
    const double luminance = 0.2126 * light.intensity.x + 0.7152 * light.intensity.y + 0.0722 * light.intensity.z;
    sum += luminance * vpl_term(point.position, point.normal, light.position, light.axis, point.clamp);
  }
  return sum * point.albedo / 3.14159265358979323846;
}

}  // namespace lightcuts::oracle
