#pragma once

#include <cstddef>
#include <cstdint>

#include "backend/light_tree.h"
#include "cpu/simd/packet.h"
#include "cpu/simd/shade_kernels.h"
#include "kernels/group_bound.h"
#include "kernels/occluder.h"

namespace lightcuts {

/// A node of a cut.
struct ChosenNode {
  std::uint32_t node;
  std::uint32_t kept;  ///< as in WaitingNode
  float bound;         ///< geometric bound over the group; 0 for a leaf, which is exact; kHidden
};
/// Stands for the bound of a node that no receiver of the group sees.
inline constexpr float kHidden = -1;

/// An inner node to go below.
struct WaitingNode {
  std::uint32_t node;
  /// What the caller knows its representative's light by, or kNone. The child with the same representative inherits it.
  std::uint32_t kept;
};

/// A walk that tests as many nodes at once as a register has lanes holds this many pairs of children at most.
inline constexpr int kMostPairs = 8;
/// From this many waiting nodes on a walk goes below one at a time, the one with fewer leaves first: what waits then
/// doubles with every entry.
inline constexpr std::uint32_t kWideWalk = 64;
/// Most nodes that wait on the stack of a walk, however deep the tree.
inline constexpr std::uint32_t kWalkStack = kWideWalk + kMostPairs + 34;

/// The walk of a group of receivers through one tree: below every node whose bound is too large for some of them.
/// It can be left when its output is full and taken up again.
struct GroupWalk {
  // What it works on.
  const LightNode* nodes;
  ReceiverGroup<float> group;
  Vec3 weights;             ///< a node is chosen where dot(weights, intensity) times its geometric bound is at most 1
  float min_distance_sq;    ///< [m^2]
  const WaitingNode* feed;  ///< more nodes to go below, taken from the end
  std::uint32_t feed_count;
  const Umbra* umbras;  ///< nodes in any of them are left out
  std::uint32_t umbra_count;
  bool tell_hidden;  ///< hands over the nodes left out too
  // Where it stands.
  std::uint32_t waiting_count;
  WaitingNode waiting[kWalkStack];
  std::uint64_t visits;  ///< nodes tested
};

/// Walks on until nothing waits or fewer than 2 * kMostPairs places are left in `chosen`; returns how many were filled.
/// walk.waiting_count == 0 and walk.feed_count == 0 afterwards say that it is done.
using WalkFn = std::uint32_t (*)(GroupWalk&, ChosenNode* chosen, std::uint32_t capacity);

/// A chosen node as the inner loops read it.
struct CutLight {
  Vec3 position;  ///< of the representative; VPLs only, and so is the axis
  float bound;    ///< as in ChosenNode
  Vec3 axis;
  std::uint32_t node;
  Vec3 intensity;       ///< of the whole cluster
  std::uint32_t light;  ///< representative, index within its kind
};

/// How much of a representative's light arrives at each receiver of a packet.
struct alignas(64) PacketShare {
  float of[kPacketSize];
};

/// What a sum over chosen nodes sets.
struct alignas(64) CutSum {
  PacketSum sum;
  float largest[kPacketSize];  ///< largest bound on the luminance that a node is reflected with, times pi
};

/// Chosen nodes of one kind of light, and the receivers that they light.
struct CutTask {
  const ReceiverPacket& receivers;
  const PacketVec3& weights;  ///< reflected_weights of each receiver
  const CutLight* lights;
  const PacketShare* shares;  ///< one a light; null: all light arrives
  std::size_t count;
};

/// Places of lights, or unit vectors to directional ones, side by side. Arrays may be read up to a multiple of kPacketSize.
struct LightPlaces {
  const float *x, *y, *z;
  std::size_t count;
  bool directions;
};

/// The inner loops of the packet cut, compiled once for each instruction set.
struct CutKernels {
  WalkFn walk[3];  ///< by LightKind
  /// Which of at most 16 nodes lie in some umbra, as bits.
  std::uint32_t (*hidden[3])(const Umbra* umbras, std::uint32_t umbra_count, const LightNode* const* nodes, int count);

  /// Takes the places that lie in an umbra from those that are left, bit i % 16 of word i / 16; returns whether there were any.
  bool (*hides_any)(const Umbra&, const LightPlaces&, std::uint16_t* left);

  void (*sum_vpls)(const CutTask&, float min_distance_sq, CutSum&);
  void (*sum_points)(const CutTask&, const PointRecord*, CutSum&);
  void (*sum_directionals)(const CutTask&, const DirectionalRecord*, CutSum&);
};

/// The kernels of an instruction set that this machine runs.
const CutKernels& cut_kernels(Isa isa);

}  // namespace lightcuts
