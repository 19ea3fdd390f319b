#pragma once

#include <cstddef>
#include <cstdint>

#include "backend/light_tree.h"
#include "cpu/simd/packet.h"
#include "cpu/simd/shade_kernels.h"

namespace lightcuts {

/// Most nodes that wait on the stack of a walk: it goes into the child with fewer leaves first, so what waits doubles with
/// every entry.
inline constexpr int kWalkStack = 34;

/// A node of the cut of some pixels of a packet.
struct ChosenNode {
  std::uint32_t node;
  std::uint32_t lanes;  ///< bit i: it is in the cut of pixel i
};

/// The walk of a packet of pixels through one tree: every pixel goes below the nodes whose bound exceeds its threshold.
/// It can be left when its output is full and taken up again.
struct alignas(64) PacketWalk {
  // What it works on.
  const LightNode* nodes;
  PacketVec3 weights;                        ///< reflected_weights of each pixel
  alignas(64) float threshold[kPacketSize];  ///< of the bound on luminance, times pi
  float min_distance_sq;                     ///< [m^2]
  float size_limit;                          ///< pixels whose cut grows beyond it leave the walk, even for other trees
  // What it leaves, added up over trees.
  alignas(64) float largest[kPacketSize];  ///< largest bound of a chosen node
  alignas(64) float size[kPacketSize];     ///< nodes chosen
  std::uint64_t visits;                    ///< nodes tested
  // Where it stands.
  ChosenNode waiting[kWalkStack];  ///< nodes to go below
  std::uint32_t waiting_count;
};

/// Walks on until the tree is done or fewer than 2 places are left in `chosen`; returns how many were filled.
/// walk.waiting_count == 0 afterwards says that the tree is done.
using WalkFn = std::uint32_t (*)(const ReceiverPacket&, PacketWalk&, ChosenNode* chosen, std::uint32_t capacity);

/// Sets up a walk from the root of walk.nodes for `lanes`; the root itself may be chosen: returns 1 then.
using StartFn = std::uint32_t (*)(const ReceiverPacket&, PacketWalk&, std::uint32_t lanes, ChosenNode* chosen);

/// The inner loops of the packet cut, compiled once for each instruction set.
struct CutKernels {
  StartFn start[3];  ///< by LightKind
  WalkFn walk[3];

  /// Sets `sum` to the chosen nodes' light, all of it arriving: intensity of the node, factor of its representative.
  void (*sum_vpls)(const ReceiverPacket&, const LightNode* nodes, const VplRecord*, const ChosenNode*,
                   std::size_t count, float min_distance_sq, PacketSum& sum);
  void (*sum_points)(const ReceiverPacket&, const LightNode* nodes, const PointRecord*, const ChosenNode*,
                     std::size_t count, PacketSum& sum);
  void (*sum_directionals)(const ReceiverPacket&, const LightNode* nodes, const DirectionalRecord*, const ChosenNode*,
                           std::size_t count, PacketSum& sum);
};

/// The kernels of an instruction set that this machine runs.
const CutKernels& cut_kernels(Isa isa);

}  // namespace lightcuts
