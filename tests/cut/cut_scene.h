#pragma once

#include <memory>
#include <string>

#include "cpu/cut/group_cut.h"
#include "cpu/cut/pixel_cut.h"
#include "cpu/tree/build_light_trees.h"
#include "cpu_shade/random_packet.h"
#include "cut/cut_check.h"

namespace lightcuts::test {

/// Lights with their trees, and receivers without a scene: what cuts are made of.
struct CutScene {
  Lights lights;
  LightSet set;
  LightTrees trees;
  LightMarks marks;
  CutContext context;

  explicit CutScene(Lights of, float error = 0.02f, std::uint32_t max_cut = 0, float min_distance = 0.05f)
      : lights(std::move(of)),
        set(make_light_set(lights)),
        trees(build_light_trees(lights, 3, {})),
        marks(trees),
        context{trees, set, nullptr, min_distance * min_distance, error, max_cut, marks} {}
  CutScene(const CutScene&) = delete;
};

/// Sixteen random receivers with random albedos.
inline SurfacePacket random_surfaces(Dice& dice, bool flat = false) {
  SurfacePacket packet{};
  packet.receivers = random_receivers(dice, flat);
  packet.inside_picture = packet.receivers.active;
  for (int lane = 0; lane < kPacketSize; ++lane) set_lane(packet.albedo, lane, dice.color());
  return packet;
}

/// Sixteen receivers on a slanted plane or a ball, this far apart [m], of one colour.
inline SurfacePacket coherent_surfaces(Dice& dice, float size, bool curved) {
  SurfacePacket packet = random_surfaces(dice, !curved);
  const Vec3 middle = get_lane(packet.receivers.position, 0), normal = get_lane(packet.receivers.ng, 0);
  const Vec3 any = dice.direction();
  const Vec3 u = normalize(cross(normal, any)), v = cross(normal, u);
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const float x = size * static_cast<float>(lane % 4), y = size * static_cast<float>(lane / 4);
    const Vec3 n = curved ? normalize(normal + u * x + v * y) : normal;
    set_lane(packet.receivers.position, lane, curved ? middle + (n - normal) : middle + u * x + v * y);
    set_lane(packet.receivers.ns, lane, n);
    set_lane(packet.receivers.ng, lane, n);
    set_lane(packet.albedo, lane, get_lane(packet.albedo, 0) * (1 - 0.02f * static_cast<float>(lane)));
  }
  return packet;
}

inline CheckedPoint point_of(const SurfacePacket& packet, int lane, const CutScene& scene) {
  const ReceiverPacket& r = packet.receivers;
  return {get_lane(r.position, lane), get_lane(r.ns, lane), get_lane(r.ng, lane), get_lane(packet.albedo, lane),
          std::sqrt(static_cast<double>(scene.context.min_distance_sq))};
}

/// The heap's cut of one pixel.
inline PixelCut heap_cut_of(const CutScene& scene, const SurfacePacket& packet, int lane) {
  PixelLights lights(scene.context, packet, lane);
  PixelCut cut;
  cut_by_heap(scene.context, lights, cut);
  return cut;
}
inline CutNodes nodes_of(const PixelCut& cut) {
  CutNodes nodes;
  for (const CutNode& c : cut.nodes) nodes[static_cast<std::size_t>(c.kind)].push_back(c.node);
  return nodes;
}

/// Collects what each pixel of a packet chose.
class CutCollector final : public CutListener {
 public:
  std::array<CutNodes, kPacketSize> cuts;
  std::array<ReceiverGroup<float>, kPacketSize> groups;

  void chosen(LightKind kind, std::uint32_t node, const ReceiverGroup<float>& group,
              std::span<const std::uint8_t> pixels) override {
    for (const std::uint8_t pixel : pixels) {
      cuts[pixel][static_cast<std::size_t>(kind)].push_back(node);
      groups[pixel] = group;
    }
  }
  void hidden(LightKind, std::uint32_t, const ReceiverGroup<float>&, std::span<const std::uint8_t>) override {}
};

/// Groups as without shadows, or of single pixels.
inline constexpr GroupTuning kAnyGroups{.extent = 1, .cosine = 0, .pixels = 64, .first_factor = 0.9f, .level_ratio = 2};
inline constexpr GroupTuning kSinglePixels{
    .extent = 1, .cosine = 0, .pixels = 1, .first_factor = 0.9f, .level_ratio = 2};

inline TileLight packet_cut_of(const CutScene& scene, const SurfacePacket& packet, CutCollector& collector, Isa isa,
                               const GroupTuning& tuning = kAnyGroups, double guess_scale = 1) {
  const Frontier frontier = make_frontier(scene.context, 64);
  CutScratch scratch;
  TileLight lit;
  const std::span<const SurfacePacket> packets(&packet, 1);
  cut_pixels({scene.context, frontier, cut_kernels(isa), shade_kernels(isa), tuning, &collector, guess_scale}, packets,
             scratch, lit);
  return lit;
}

/// What a lane's cut promises, by the bounds of its group.
inline DoubleCheck check_lane(const CutScene& scene, const SurfacePacket& packet, const CutCollector& collector,
                              int lane) {
  const CheckedPoint point = point_of(packet, lane, scene);
  return check_again(scene.lights, scene.trees, collector.cuts[lane], point, [&](const LightNode& node, int kind) {
    return bound_of(node, kind, collector.groups[lane], point.min_distance);
  });
}

inline double total_of(const TileLight& lit, const SurfacePacket& packet, int lane) {
  const Vec3 albedo = get_lane(packet.albedo, lane);
  return luminance(
      Vec3T<double>{albedo.x * lit.light[lane].x, albedo.y * lit.light[lane].y, albedo.z * lit.light[lane].z});
}

/// VPLs, points (half of them spots) and directional lights around the origin.
inline Lights mixed_lights(unsigned seed, int vpls, int points, int directionals) {
  Dice dice(seed);
  Lights lights;
  for (int i = 0; i < vpls; ++i) lights.vpls.push_back({dice.in_box(1.5f), dice.direction(), dice.color()});
  for (int i = 0; i < points; ++i) {
    PointLight light{dice.in_box(2), dice.color(), dice.direction()};
    if (i % 2 == 0) {
      light.cos_inner = 0.8f;
      light.cos_outer = 0.3f;
    }
    lights.points.push_back(light);
  }
  for (int i = 0; i < directionals; ++i) lights.directionals.push_back({dice.direction(), dice.color()});
  return lights;
}

}  // namespace lightcuts::test
