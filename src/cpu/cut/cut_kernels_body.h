// The kernels' text, included once by each cut_kernels_ISA.cpp, which defines LC_ISA.
// No include guard on purpose.

#include <limits>

#include "cpu/cut/bound_lanes.h"
#include "cpu/cut/cut_kernels.h"
#include "cpu/simd/lanes.h"
#include "kernels/cluster_bound.h"
#include "kernels/light.h"

namespace lightcuts::LC_ISA {
namespace {

using LanesVec3 = Vec3T<Lanes>;
using BoundVec3 = Vec3T<BoundLanes>;

LC_LANES_FN LanesVec3 broadcast(const Vec3& v) { return {Lanes(v.x), Lanes(v.y), Lanes(v.z)}; }
LC_LANES_FN LanesVec3 load(const PacketVec3& v, int first) {
  return {Lanes::load(v.x + first), Lanes::load(v.y + first), Lanes::load(v.z + first)};
}
LC_LANES_FN BoundVec3 load_bound(const PacketVec3& v, int first) {
  return {Batch::load_aligned(v.x + first), Batch::load_aligned(v.y + first), Batch::load_aligned(v.z + first)};
}

// --- Choosing ---

struct VplBound {
  LC_LANES_FN static BoundLanes geometric(const LitPoint<BoundLanes>& point, const LightNode& node, float clamp_sq) {
    return vpl_bound(point, node.box, DirectionCone{node.axis, node.cos_half_angle}, BoundLanes(clamp_sq));
  }
};
struct PointBound {
  LC_LANES_FN static BoundLanes geometric(const LitPoint<BoundLanes>& point, const LightNode& node, float) {
    return point_bound(point, node.box, DirectionCone{node.axis, node.cos_half_angle}, BoundLanes(kPointGuardSq));
  }
};
struct DirectionalBound {
  LC_LANES_FN static BoundLanes geometric(const LitPoint<BoundLanes>& point, const LightNode& node, float) {
    return directional_bound(point.normal, node.box);
  }
};

/// Tests one inner node for `lanes`; returns those that accept it. A bound that is not a number or infinite is refused.
template <class Bound>
LC_LANES_FN std::uint32_t test_inner(const ReceiverPacket& packet, PacketWalk& walk, const LightNode& node,
                                     std::uint32_t lanes) {
  std::uint32_t accepted = 0;
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const std::uint32_t mine = lanes >> first & Lanes::kAllBits;
    if (mine == 0) continue;
    const LitPoint<BoundLanes> point{load_bound(packet.position, first), load_bound(packet.ns, first)};
    const BoundVec3 weights = load_bound(walk.weights, first);
    const BoundLanes power = weights.x * BoundLanes(node.intensity.x) + weights.y * BoundLanes(node.intensity.y) +
                             weights.z * BoundLanes(node.intensity.z);
    const Batch bound = (power * Bound::geometric(point, node, walk.min_distance_sq)).value;
    const BatchBool in_cut = (bound <= Batch::load_aligned(walk.threshold + first)) & lanes_of(mine);
    const Batch largest = Batch::load_aligned(walk.largest + first);
    xsimd::select(in_cut, xsimd::max(largest, bound), largest).store_aligned(walk.largest + first);
    accepted |= bits(Mask{in_cut}) << first;
  }
  return accepted;
}

LC_LANES_FN void count(PacketWalk& walk, std::uint32_t lanes) {
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Batch size = Batch::load_aligned(walk.size + first);
    xsimd::select(lanes_of(lanes >> first & Lanes::kAllBits), size + Batch(1.0f), size)
        .store_aligned(walk.size + first);
  }
}

/// Lanes whose cut is not too large yet.
LC_LANES_FN std::uint32_t within_limit(const PacketWalk& walk) {
  std::uint32_t within = 0;
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    within |= bits(Mask{Batch::load_aligned(walk.size + first) <= Batch(walk.size_limit)}) << first;
  }
  return within;
}

/// Tests a node; chooses it for the lanes that accept it and returns the others.
template <class Bound>
LC_LANES_FN std::uint32_t visit(const ReceiverPacket& packet, PacketWalk& walk, std::uint32_t index,
                                std::uint32_t lanes, ChosenNode* chosen, std::uint32_t& chosen_count) {
  const LightNode& node = walk.nodes[index];
  const std::uint32_t accepted = node.is_leaf() ? lanes : test_inner<Bound>(packet, walk, node, lanes);
  if (accepted != 0) {
    chosen[chosen_count++] = {index, accepted};
    count(walk, accepted);
  }
  return lanes & ~accepted;
}

LC_LANES_FN void wait(PacketWalk& walk, std::uint32_t index, std::uint32_t lanes) {
  if (lanes == 0) return;
  __builtin_prefetch(&walk.nodes[walk.nodes[index].first_child]);
  __builtin_prefetch(&walk.nodes[walk.nodes[index].first_child + 1]);
  walk.waiting[walk.waiting_count++] = {index, lanes};
}

template <class Bound>
std::uint32_t start(const ReceiverPacket& packet, PacketWalk& walk, std::uint32_t lanes, ChosenNode* chosen) {
  std::uint32_t chosen_count = 0;
  walk.waiting_count = 0;
  ++walk.visits;
  lanes &= within_limit(walk);
  if (lanes != 0) wait(walk, 0, visit<Bound>(packet, walk, 0, lanes, chosen, chosen_count));
  return chosen_count;
}

template <class Bound>
std::uint32_t walk_on(const ReceiverPacket& packet, PacketWalk& walk, ChosenNode* chosen, std::uint32_t capacity) {
  std::uint32_t chosen_count = 0;
  while (walk.waiting_count > 0 && chosen_count + 2 <= capacity) {
    const ChosenNode top = walk.waiting[--walk.waiting_count];
    const std::uint32_t lanes = top.lanes & within_limit(walk);
    if (lanes == 0) continue;
    // The child with fewer leaves is waited for last, that is, comes next.
    const std::uint32_t p = walk.nodes[top.node].first_child, q = p + 1;
    walk.visits += 2;
    const std::uint32_t below_p = visit<Bound>(packet, walk, p, lanes, chosen, chosen_count);
    const std::uint32_t below_q = visit<Bound>(packet, walk, q, lanes, chosen, chosen_count);
    const bool p_is_larger = walk.nodes[p].leaf_count > walk.nodes[q].leaf_count;
    wait(walk, p_is_larger ? p : q, p_is_larger ? below_p : below_q);
    wait(walk, p_is_larger ? q : p, p_is_larger ? below_q : below_p);
  }
  return chosen_count;
}

// --- Light of what was chosen, without visibility ---

LC_LANES_FN Receiver<Lanes> load_receiver(const ReceiverPacket& packet, int first) {
  return {load(packet.position, first), load(packet.ns, first), load(packet.ng, first)};
}

LC_LANES_FN Lanes only(std::uint32_t lanes, Lanes value) {
  return xsimd::select(lanes_of(lanes), value.value, Batch(0.0f));
}

/// How far ahead records are fetched: their places in memory are scattered.
constexpr std::size_t kAhead = 8;

void sum_vpls(const ReceiverPacket& packet, const LightNode* nodes, const VplRecord* vpls, const ChosenNode* chosen,
              std::size_t chosen_count, float min_distance_sq, PacketSum& sum) {
  const Lanes clamp_sq(min_distance_sq);
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes> receiver = load_receiver(packet, first);
    LanesVec3 light = broadcast(Vec3{});
    Lanes lost(0.0f);
    for (std::size_t i = 0; i < chosen_count; ++i) {
      if (i + kAhead < chosen_count) __builtin_prefetch(&vpls[nodes[chosen[i + kAhead].node].representative]);
      const std::uint32_t lanes = chosen[i].lanes >> first & Lanes::kAllBits;
      if (lanes == 0) continue;
      const LightNode& node = nodes[chosen[i].node];
      const VplRecord& vpl = vpls[node.representative];
      const VplFactor<Lanes> factor = vpl_factor(receiver, broadcast(vpl.position), broadcast(vpl.axis), clamp_sq);
      light += broadcast(node.intensity) * only(lanes, factor.clamped);
      if ((bits(factor.distance_sq < clamp_sq) & lanes) != 0) {
        lost = lost + only(lanes, factor.unclamped - factor.clamped) * Lanes(luminance(node.intensity));
      }
    }
    light.x.store(sum.light.x + first);
    light.y.store(sum.light.y + first);
    light.z.store(sum.light.z + first);
    lost.store(sum.lost + first);
  }
}

/// The same for lights without a clamp; `factor_of(receiver, record)` is theirs.
template <class Record, class Factor>
LC_LANES_FN void sum_unclamped(const ReceiverPacket& packet, const LightNode* nodes, const Record* records,
                               const ChosenNode* chosen, std::size_t chosen_count, PacketSum& sum, Factor factor_of) {
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes> receiver = load_receiver(packet, first);
    LanesVec3 light = broadcast(Vec3{});
    for (std::size_t i = 0; i < chosen_count; ++i) {
      if (i + kAhead < chosen_count) __builtin_prefetch(&records[nodes[chosen[i + kAhead].node].representative]);
      const std::uint32_t lanes = chosen[i].lanes >> first & Lanes::kAllBits;
      if (lanes == 0) continue;
      const LightNode& node = nodes[chosen[i].node];
      light += broadcast(node.intensity) * only(lanes, factor_of(receiver, records[node.representative]));
    }
    light.x.store(sum.light.x + first);
    light.y.store(sum.light.y + first);
    light.z.store(sum.light.z + first);
    Lanes(0.0f).store(sum.lost + first);
  }
}

struct PointFactor {
  LC_LANES_FN Lanes operator()(const Receiver<Lanes>& receiver, const PointRecord& point) const {
    return point_factor(receiver, Spot<Lanes>{broadcast(point.position), broadcast(point.axis), Lanes(point.cos_outer),
                                              Lanes(point.inverse_range)});
  }
};
struct DirectionalFactor {
  LC_LANES_FN Lanes operator()(const Receiver<Lanes>& receiver, const DirectionalRecord& light) const {
    return directional_factor(receiver, broadcast(light.direction));
  }
};

void sum_points(const ReceiverPacket& packet, const LightNode* nodes, const PointRecord* points,
                const ChosenNode* chosen, std::size_t chosen_count, PacketSum& sum) {
  sum_unclamped(packet, nodes, points, chosen, chosen_count, sum, PointFactor{});
}

void sum_directionals(const ReceiverPacket& packet, const LightNode* nodes, const DirectionalRecord* lights,
                      const ChosenNode* chosen, std::size_t chosen_count, PacketSum& sum) {
  sum_unclamped(packet, nodes, lights, chosen, chosen_count, sum, DirectionalFactor{});
}

}  // namespace

extern const CutKernels cut_kernels;
const CutKernels cut_kernels{{start<VplBound>, start<PointBound>, start<DirectionalBound>},
                             {walk_on<VplBound>, walk_on<PointBound>, walk_on<DirectionalBound>},
                             sum_vpls,
                             sum_points,
                             sum_directionals};

}  // namespace lightcuts::LC_ISA
