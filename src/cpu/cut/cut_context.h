#pragma once

#include <cstdint>
#include <limits>

#include "backend/light_tree.h"
#include "cpu/cut/light_marks.h"
#include "cpu/light_set.h"
#include "cpu/tile.h"
#include "cpu/visibility.h"
#include "kernels/cut_criterion.h"
#include "kernels/occluder.h"

namespace lightcuts {

/// What every way of cutting works on. Everything referred to must outlive it; trees and lights belong together.
struct CutContext {
  const LightTrees& trees;
  const LightSet& lights;
  const PacketVisibility* visibility;  ///< null: all light arrives
  float min_distance_sq;               ///< square of the clamp of the VPL singularity [m^2]
  float error;                         ///< bound on each node relative to the pixel's total
  std::uint32_t max_cut;               ///< largest cut, 0: none
  LightMarks& marks;
  OccluderView occluders{};  ///< what hides lights for certain; none without shadows
  double gain = 1;           ///< the light of nodes that are not single lights is multiplied by this; see calibration.h

  /// What a node's bound on luminance may be at most [same unit as total].
  [[nodiscard]] double threshold(double total) const { return error * (1 - kThresholdSlack) * total; }
};

inline const LightTree& tree_of(const LightTrees& trees, LightKind kind) {
  return kind == LightKind::vpl ? trees.vpls : kind == LightKind::point ? trees.points : trees.directionals;
}
inline constexpr LightKind kLightKinds[] = {LightKind::vpl, LightKind::point, LightKind::directional};

/// What a pixel's cut leaves beside its light.
inline void record_cut(TileLight& out, int pixel, std::uint64_t size, double largest_bound, double total,
                       const CutContext& context) {
  constexpr float most = std::numeric_limits<float>::max();
  out.cut_size[pixel] = static_cast<std::uint32_t>(size);
  out.cut_bound[pixel] = !(largest_bound > 0)           ? 0.0f
                         : largest_bound < most * total ? static_cast<float>(largest_bound / total)
                                                        : most;
  out.cut_at_limit[pixel] = largest_bound > context.threshold(total);
}

}  // namespace lightcuts
