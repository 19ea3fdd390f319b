#pragma once

#include <cstddef>

#include "cpu/cut/cut_context.h"
#include "cpu/cut/cut_kernels.h"

namespace lightcuts {

inline std::size_t index(LightKind kind) { return static_cast<std::size_t>(kind); }

/// A node of a tree as the inner loops read it.
inline CutLight cut_light(const CutContext& context, LightKind kind, std::uint32_t node_index, float bound) {
  const LightNode& node = tree_of(context.trees, kind).nodes[node_index];
  CutLight light{{}, bound, {}, node_index, node.intensity, node.representative};
  if (kind == LightKind::vpl) {
    const Vpl& vpl = context.lights.vpls[node.representative];
    light.position = vpl.position;
    light.axis = vpl.axis;
  }
  return light;
}

}  // namespace lightcuts
