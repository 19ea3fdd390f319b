#pragma once

#include <vector>

#include "cpu/cut/pixel_lights.h"

namespace lightcuts {

/// One node of a pixel's cut.
struct CutNode {
  float bound;  ///< as PixelLights::bound
  std::uint32_t node;
  LightKind kind;
  UnitLight unit;  ///< of the representative
};

/// A pixel's cut and the light that it gives.
struct PixelCut {
  std::vector<CutNode> nodes;
  Vec3T<double> light;       ///< sum [W/m^2]; times albedo / pi it is reflected radiance
  double lost = 0;           ///< luminance that the clamp took
  double total = 0;          ///< luminance of the reflected light, times pi
  double largest_bound = 0;  ///< of a node, in the total's unit
};

/// The textbook cut of one pixel: from the roots of the three trees on, refines the node with the largest bound until
/// that is at most `error` of the total, or the cut has `max_cut` nodes.
///
/// A child that keeps its parent's representative keeps its light, so a refinement costs one evaluation and at most one
/// shadow ray. `cut` is filled anew; it is passed in so that its memory serves many pixels.
/// Source: Walter et al. 2005.
void cut_by_heap(const CutContext& context, PixelLights& lights, PixelCut& cut);

}  // namespace lightcuts
