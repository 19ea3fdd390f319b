#pragma once

#include <memory>
#include <string>

#include "cpu/cut/packet_cut.h"
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
  int starts = 0;

  void start(std::uint32_t lanes) override {
    ++starts;
    for (int lane = 0; lane < kPacketSize; ++lane) {
      if ((lanes >> lane & 1u) != 0) cuts[lane] = {};
    }
  }
  void chosen(LightKind kind, ChosenNode node) override {
    for (int lane = 0; lane < kPacketSize; ++lane) {
      if ((node.lanes >> lane & 1u) != 0) cuts[lane][static_cast<std::size_t>(kind)].push_back(node.node);
    }
  }
};

inline PacketLight packet_cut_of(const CutScene& scene, const SurfacePacket& packet, CutCollector& collector, Isa isa,
                                 Arrival arrival = {}) {
  const Frontier frontier = make_frontier(scene.trees, 64);
  PacketLight lit;
  cut_packet({scene.context, frontier, cut_kernels(isa), shade_kernels(isa), &collector}, packet, arrival, lit);
  return lit;
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
