#pragma once

#include "cpu/light_set.h"
#include "cpu/simd/shade_kernels.h"
#include "cpu/tile_lighter.h"
#include "cpu/visibility.h"

namespace lightcuts {

/// Instant Radiosity: the sum over every light. Source: Keller 1997.
class AllLights final : public TileLighter {
 public:
  /// Everything referred to must outlive this.
  ///
  /// @param visibility    how much of a light arrives; null: all of it
  /// @param min_distance  clamp of the VPL singularity [m], 0: none
  AllLights(const ShadeKernels& kernels, const LightSet& lights, const PacketVisibility* visibility, float min_distance)
      : kernels_(kernels), lights_(lights), visibility_(visibility), min_distance_sq_(min_distance * min_distance) {}

  bool light(const Tile& tile, Progress& progress, TileLight& out) const override;

 private:
  template <class Kind>
  bool light_by(const Kind& kind, const Tile& tile, Progress& progress, TileLight& out) const;

  const ShadeKernels& kernels_;
  const LightSet& lights_;
  const PacketVisibility* visibility_;
  float min_distance_sq_;
};

}  // namespace lightcuts
