#include "cpu/cut/pixel_lights.h"

#include <algorithm>
#include <limits>

#include "kernels/cluster_bound.h"
#include "kernels/light.h"
#include "kernels/offset_point.h"

namespace lightcuts {
namespace {

Vec3 lane_of(const PacketVec3& packet, int lane) { return {packet.x[lane], packet.y[lane], packet.z[lane]}; }

float geometric_bound(LightKind kind, const LitPoint<float>& point, const LightNode& node, float min_distance_sq) {
  const DirectionCone cone{node.axis, node.cos_half_angle};
  switch (kind) {
    case LightKind::vpl:
      return vpl_bound(point, node.box, cone, min_distance_sq);
    case LightKind::point:
      return point_bound(point, node.box, cone, kPointGuardSq);
    case LightKind::directional:
      return directional_bound(point.normal, node.box);
  }
  return std::numeric_limits<float>::infinity();
}

}  // namespace

PixelLights::PixelLights(const CutContext& context, const SurfacePacket& packet, int lane)
    : context_(context),
      receivers_(packet.receivers),
      lane_(lane),
      position_(lane_of(packet.receivers.position, lane)),
      ns_(lane_of(packet.receivers.ns, lane)),
      ng_(lane_of(packet.receivers.ng, lane)),
      weights_(reflected_weights(lane_of(packet.albedo, lane))) {}

LightWay PixelLights::way_to(LightKind kind, std::uint32_t light) const {
  const Receiver<float> receiver{position_, ns_, ng_};
  switch (kind) {
    case LightKind::vpl: {
      const Vpl& vpl = context_.lights.vpls[light];
      const VplFactor<float> factor = vpl_factor(receiver, vpl.position, vpl.axis, context_.min_distance_sq);
      return {{factor.clamped, factor.unclamped}, offset_point(vpl.position, vpl.axis) - position_, 1.0f};
    }
    case LightKind::point: {
      const PointRecord& point = context_.lights.points[light];
      const Spot<float> spot{point.position, point.axis, point.cos_outer, point.inverse_range};
      const float factor = point_factor(receiver, spot);
      return {{factor, factor}, point.position - position_, 1.0f};
    }
    case LightKind::directional: {
      const Vec3 direction = context_.lights.directionals[light].direction;
      const float factor = directional_factor(receiver, direction);
      return {{factor, factor}, -direction, std::numeric_limits<float>::infinity()};
    }
  }
  return {};
}

UnitLight PixelLights::seen(LightKind kind, std::uint32_t light, const LightWay& way) {
  if (context_.visibility == nullptr || !(way.unit.clamped > 0)) return way.unit;
  // One ray in all lanes: whatever looks at the packet as a whole finds it coherent.
  RayPacket16 rays;
  for (int lane = 0; lane < kPacketSize; ++lane) rays.set(lane, position_, way.direction, way.t_max);
  alignas(64) float share[kPacketSize];
  rays_ += context_.visibility->shares({kind, light, receivers_, rays, 1u << lane_}, share);
  return {way.unit.clamped * share[lane_], way.unit.unclamped * share[lane_]};
}

UnitLight PixelLights::evaluate(LightKind kind, std::uint32_t light) {
  ++evaluations_;
  return seen(kind, light, way_to(kind, light));
}

float PixelLights::bound(LightKind kind, const LightNode& node) const {
  if (node.is_leaf()) return 0;
  const float bound =
      dot(weights_, node.intensity) * geometric_bound(kind, {position_, ns_}, node, context_.min_distance_sq);
  // Sums of lights of absurd strength: split them.
  return bound <= std::numeric_limits<float>::max() ? bound : std::numeric_limits<float>::infinity();
}

}  // namespace lightcuts
