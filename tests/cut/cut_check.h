#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "backend/light_tree.h"
#include "kernels/cluster_bound.h"
#include "kernels/group_bound.h"
#include "kernels/light.h"
#include "lightcuts/lights.h"
#include "oracle/light_oracle.h"

namespace lightcuts::test {

/// Nodes of one pixel's cut, by kind of light: VPLs, points, directionals.
using CutNodes = std::array<std::vector<std::uint32_t>, 3>;

/// A receiver as the checks see it.
struct CheckedPoint {
  Vec3 position, ns, ng, albedo;
  double min_distance = 0;
};

inline double luminance_of(Vec3 albedo, Vec3 intensity) {
  return 0.2126 * albedo.x * intensity.x + 0.7152 * albedo.y * intensity.y + 0.0722 * albedo.z * intensity.z;
}

inline void mark_leaves(const LightTree& tree, std::uint32_t node, std::vector<int>& times) {
  std::vector<std::uint32_t> pending{node};
  while (!pending.empty()) {
    const LightNode& top = tree.nodes[pending.back()];
    pending.pop_back();
    if (top.is_leaf()) {
      ++times[top.representative];
    } else {
      pending.insert(pending.end(), {top.first_child, top.second_child()});
    }
  }
}

/// A cut holds every light exactly once.
inline bool holds_each_light_once(const LightTree& tree, const std::vector<std::uint32_t>& cut) {
  std::vector<int> times(tree.nodes.empty() ? 0 : tree.nodes.size() / 2 + 1, 0);
  for (const std::uint32_t node : cut) mark_leaves(tree, node, times);
  return std::all_of(times.begin(), times.end(), [](int n) { return n == 1; });
}

/// What a cut promises, evaluated again in double precision; luminances times pi.
struct DoubleCheck {
  double total = 0;        ///< unshadowed estimate of the cut
  double exact = 0;        ///< sum over all lights
  double largest = 0;      ///< bound of a node that is not a leaf
  double worst_error = 0;  ///< of a node's estimate against the sum over its lights
  double bound_sum = 0;
};

/// Term of one light, by the oracle. @param index among the lights of its kind
inline double oracle_factor(const Lights& lights, int kind, std::uint32_t index, const CheckedPoint& p) {
  if (kind == 0) {
    const Vpl& v = lights.vpls[index];
    return oracle::vpl_factor(p.position, p.ns, p.ng, v.position, v.axis, p.min_distance);
  }
  if (kind == 1) return oracle::point_factor(p.position, p.ns, p.ng, lights.points[index]);
  return oracle::directional_factor(p.ns, p.ng, lights.directionals[index].direction);
}

inline Vec3 intensity_of(const Lights& lights, int kind, std::uint32_t index) {
  return kind == 0   ? lights.vpls[index].intensity
         : kind == 1 ? lights.points[index].intensity
                     : lights.directionals[index].irradiance;
}

/// Geometric bound of a cluster in double precision.
inline double bound_of(const LightNode& node, int kind, const CheckedPoint& p) {
  const auto wide = [](Vec3 v) { return Vec3T<double>{v.x, v.y, v.z}; };
  const LitPoint<double> point{wide(p.position), wide(p.ns)};
  const DirectionCone cone{node.axis, node.cos_half_angle};
  if (kind == 0) return vpl_bound<double>(point, node.box, cone, p.min_distance * p.min_distance);
  if (kind == 1) return point_bound<double>(point, node.box, cone, double(kPointGuardSq));
  return directional_bound<double>(point.normal, node.box);
}

/// The same over a group of receivers.
inline double bound_of(const LightNode& node, int kind, const ReceiverGroup<float>& g, double min_distance) {
  const auto wide = [](Vec3 v) { return Vec3T<double>{v.x, v.y, v.z}; };
  const ReceiverGroup<double> group{wide(g.lo),       wide(g.hi), wide(g.axis), g.cos_half_angle,
                                    g.sin_half_angle, g.gain_lo,  g.gain_hi};
  const ClusterBounds<double> lights{wide(node.box.lo), wide(node.box.hi), wide(node.axis), node.cos_half_angle};
  if (kind == 0) return group_vpl_bound<double>(group, lights, min_distance * min_distance);
  if (kind == 1) return group_point_bound<double>(group, lights, double(kPointGuardSq));
  return group_directional_bound<double>(group, lights);
}

/// Sum over the lights below a node.
inline double node_sum(const Lights& lights, const LightTree& tree, int kind, std::uint32_t node,
                       const CheckedPoint& p) {
  double sum = 0;
  std::vector<std::uint32_t> pending{node};
  while (!pending.empty()) {
    const LightNode& top = tree.nodes[pending.back()];
    pending.pop_back();
    if (top.is_leaf()) {
      const std::uint32_t light = top.representative;
      sum += luminance_of(p.albedo, intensity_of(lights, kind, light)) * oracle_factor(lights, kind, light, p);
    } else {
      pending.insert(pending.end(), {top.first_child, top.second_child()});
    }
  }
  return sum;
}

/// @param geometric_bound  of a node: called with the node and the kind of its lights
template <class Bound>
DoubleCheck check_again(const Lights& lights, const LightTrees& trees, const CutNodes& cut, const CheckedPoint& p,
                        const Bound& geometric_bound) {
  DoubleCheck check;
  const LightTree* by_kind[] = {&trees.vpls, &trees.points, &trees.directionals};
  for (int kind = 0; kind < 3; ++kind) {
    for (const std::uint32_t index : cut[kind]) {
      const LightNode& node = by_kind[kind]->nodes[index];
      const double estimate =
          luminance_of(p.albedo, node.intensity) * oracle_factor(lights, kind, node.representative, p);
      const double exact = node_sum(lights, *by_kind[kind], kind, index, p);
      check.total += estimate;
      check.exact += exact;
      if (node.is_leaf()) continue;
      const double bound = luminance_of(p.albedo, node.intensity) * geometric_bound(node, kind);
      check.largest = std::max(check.largest, bound);
      check.worst_error = std::max(check.worst_error, std::abs(estimate - exact));
      check.bound_sum += bound;
    }
  }
  return check;
}

inline DoubleCheck check_again(const Lights& lights, const LightTrees& trees, const CutNodes& cut,
                               const CheckedPoint& p) {
  return check_again(lights, trees, cut, p, [&](const LightNode& node, int kind) { return bound_of(node, kind, p); });
}

}  // namespace lightcuts::test
