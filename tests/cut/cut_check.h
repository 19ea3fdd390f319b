#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "backend/light_tree.h"
#include "kernels/cluster_bound.h"
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
  double total = 0;    ///< unshadowed estimate of the cut
  double exact = 0;    ///< sum over all lights
  double largest = 0;  ///< bound of a node that is not a leaf
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

inline DoubleCheck check_again(const Lights& lights, const LightTrees& trees, const CutNodes& cut,
                               const CheckedPoint& p) {
  DoubleCheck check;
  const LightTree* by_kind[] = {&trees.vpls, &trees.points, &trees.directionals};
  const std::size_t counts[] = {lights.vpls.size(), lights.points.size(), lights.directionals.size()};
  for (int kind = 0; kind < 3; ++kind) {
    for (const std::uint32_t index : cut[kind]) {
      const LightNode& node = by_kind[kind]->nodes[index];
      check.total += luminance_of(p.albedo, node.intensity) * oracle_factor(lights, kind, node.representative, p);
      if (node.is_leaf()) continue;
      const double bound = luminance_of(p.albedo, node.intensity) * bound_of(node, kind, p);
      check.largest = std::max(check.largest, bound);
      check.bound_sum += bound;
    }
    for (std::uint32_t i = 0; i < counts[kind]; ++i) {
      check.exact += luminance_of(p.albedo, intensity_of(lights, kind, i)) * oracle_factor(lights, kind, i, p);
    }
  }
  return check;
}

}  // namespace lightcuts::test
