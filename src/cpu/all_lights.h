#pragma once

#include "cpu/light_set.h"
#include "cpu/simd/shade_kernels.h"
#include "cpu/tile_lighter.h"
#include "cpu/visibility.h"

namespace lightcuts {

/// Some of the lights: of each kind every `stride`-th, from `offset` on.
struct LightStride {
  std::size_t offset = 0, stride = 1;

  [[nodiscard]] std::size_t count_of(std::size_t all) const {
    return all > offset ? (all - offset + stride - 1) / stride : 0;
  }
};

/// Instant Radiosity: the sum over every light. Source: Keller 1997.
class AllLights final : public TileLighter {
 public:
  /// Everything referred to must outlive this.
  ///
  /// @param visibility    how much of a light arrives; null: all of it
  /// @param min_distance  clamp of the VPL singularity [m], 0: none
  /// @param part          the lights to sum over, where there is a visibility: the rest is left to other passes
  AllLights(const ShadeKernels& kernels, const LightSet& lights, const PacketVisibility* visibility, float min_distance,
            LightStride part = {})
      : kernels_(kernels),
        lights_(lights),
        visibility_(visibility),
        min_distance_sq_(min_distance * min_distance),
        part_(visibility == nullptr ? LightStride{} : part) {}

  bool light(const Tile& tile, Progress& progress, TileLight& out) const override;

 private:
  template <class Kind>
  bool light_by(const Kind& kind, const Tile& tile, Progress& progress, TileLight& out) const;

  const ShadeKernels& kernels_;
  const LightSet& lights_;
  const PacketVisibility* visibility_;
  float min_distance_sq_;
  LightStride part_;
};

}  // namespace lightcuts
