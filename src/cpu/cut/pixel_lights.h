#pragma once

#include "backend/light_tree.h"
#include "cpu/cut/cut_context.h"

namespace lightcuts {

/// What a light of unit intensity gives to a receiver, visibility included.
struct UnitLight {
  float clamped = 0;
  float unclamped = 0;  ///< without the clamp of the VPL distance
};

/// The way from a receiver to a light of unit intensity that would give it `unit` if nothing were between.
struct LightWay {
  UnitLight unit;
  Vec3 direction;
  float t_max;
};

/// One pixel's view of lights and clusters: the same per-light evaluation as Instant Radiosity, one lane at a time, in
/// plain float arithmetic.
class PixelLights {
 public:
  /// Everything referred to must outlive this.
  PixelLights(const CutContext& context, const SurfacePacket& packet, int lane);

  [[nodiscard]] LightWay way_to(LightKind kind, std::uint32_t light) const;

  /// Traces at most one shadow ray.
  UnitLight evaluate(LightKind kind, std::uint32_t light);

  /// Bound on the luminance, times pi, that a node's lights can be reflected with; 0 for a leaf, which is exact.
  [[nodiscard]] float bound(LightKind kind, const LightNode& node) const;

  [[nodiscard]] Vec3 position() const { return position_; }
  [[nodiscard]] Vec3 weights() const { return weights_; }
  [[nodiscard]] std::uint64_t evaluations() const { return evaluations_; }
  [[nodiscard]] std::uint64_t rays() const { return rays_; }

 private:
  UnitLight seen(LightKind kind, std::uint32_t light, const LightWay& way);

  const CutContext& context_;
  const ReceiverPacket& receivers_;
  int lane_;
  Vec3 position_, ns_, ng_, weights_;
  std::uint64_t evaluations_ = 0, rays_ = 0;
};

}  // namespace lightcuts
