// The kernels' text, included once by each cut_kernels_ISA.cpp, which defines LC_ISA.
// No include guard on purpose.

#include <limits>

#include "cpu/cut/bound_lanes.h"
#include "cpu/cut/cut_kernels.h"
#include "cpu/cut/node_lanes.h"
#include "cpu/simd/lanes.h"
#include "kernels/group_bound.h"
#include "kernels/light.h"

namespace lightcuts::LC_ISA {
namespace {

using LanesVec3 = Vec3T<Lanes>;

LC_LANES_FN LanesVec3 broadcast(const Vec3& v) { return {Lanes(v.x), Lanes(v.y), Lanes(v.z)}; }
LC_LANES_FN LanesVec3 load(const PacketVec3& v, int first) {
  return {Lanes::load(v.x + first), Lanes::load(v.y + first), Lanes::load(v.z + first)};
}
LC_LANES_FN BoundVec3 broadcast_bound(const Vec3& v) { return {BoundLanes(v.x), BoundLanes(v.y), BoundLanes(v.z)}; }

// --- Choosing: one node a lane ---

LC_LANES_FN ReceiverGroup<BoundLanes> broadcast_group(const ReceiverGroup<float>& g) {
  return {broadcast_bound(g.lo),        broadcast_bound(g.hi), broadcast_bound(g.axis), BoundLanes(g.cos_half_angle),
          BoundLanes(g.sin_half_angle), BoundLanes(g.gain_lo), BoundLanes(g.gain_hi)};
}

struct VplBound {
  static constexpr bool kDirections = false;  ///< boxes of nodes hold unit vectors to the lights
  LC_LANES_FN static BoundLanes geometric(const ReceiverGroup<BoundLanes>& group,
                                          const ClusterBounds<BoundLanes>& lights, float clamp_sq) {
    return group_vpl_bound(group, lights, BoundLanes(clamp_sq));
  }
};
struct PointBound {
  static constexpr bool kDirections = false;  ///< boxes of nodes hold unit vectors to the lights
  LC_LANES_FN static BoundLanes geometric(const ReceiverGroup<BoundLanes>& group,
                                          const ClusterBounds<BoundLanes>& lights, float) {
    return group_point_bound(group, lights, BoundLanes(kPointGuardSq));
  }
};
struct DirectionalBound {
  static constexpr bool kDirections = true;  ///< boxes of nodes hold unit vectors to the lights
  LC_LANES_FN static BoundLanes geometric(const ReceiverGroup<BoundLanes>& group,
                                          const ClusterBounds<BoundLanes>& lights, float) {
    return group_directional_bound(group, lights);
  }
};

/// The lanes whose node lies in some umbra, of those in `asked`.
template <bool Directions>
LC_LANES_FN std::uint32_t hidden_lanes(const Umbra* umbras, std::uint32_t umbra_count,
                                       const ClusterBounds<BoundLanes>& nodes, std::uint32_t asked) {
  // Every plane has the same farthest corner in all boxes: two stores pick it without a select.
  alignas(64) float ends[2][3][Lanes::kCount];
  nodes.lo.x.value.store_aligned(ends[0][0]);
  nodes.lo.y.value.store_aligned(ends[0][1]);
  nodes.lo.z.value.store_aligned(ends[0][2]);
  nodes.hi.x.value.store_aligned(ends[1][0]);
  nodes.hi.y.value.store_aligned(ends[1][1]);
  nodes.hi.z.value.store_aligned(ends[1][2]);
  const auto inside = [&](const HalfSpace& h) {
    const Batch x = Batch::load_aligned(ends[h.normal.x > 0 ? 0 : 1][0]);
    const Batch y = Batch::load_aligned(ends[h.normal.y > 0 ? 0 : 1][1]);
    const Batch z = Batch::load_aligned(ends[h.normal.z > 0 ? 0 : 1][2]);
    const Batch least = x * Batch(h.normal.x) + y * Batch(h.normal.y) + z * Batch(h.normal.z);
    return bits(Mask{least > Batch(Directions ? kUmbraDirectionSlack : -h.offset)});
  };
  std::uint32_t hidden = 0;
  for (std::uint32_t i = 0; i < umbra_count; ++i) {
    std::uint32_t lanes = asked & ~hidden;
    for (int plane = kUmbraPlanes - 1; plane >= 0 && lanes != 0; --plane) lanes &= inside(umbras[i].behind[plane]);
    hidden |= lanes;
    if (hidden == asked) break;
  }
  return hidden;
}

template <class Bound>
std::uint32_t hidden_of(const Umbra* umbras, std::uint32_t umbra_count, const LightNode* const* nodes, int count) {
  std::uint32_t hidden = 0;
  for (int first = 0; first < count; first += Lanes::kCount) {
    const int here = count - first < Lanes::kCount ? count - first : Lanes::kCount;
    const float* node[Lanes::kCount];
    for (int i = 0; i < Lanes::kCount; ++i) {
      node[i] = reinterpret_cast<const float*>(nodes[first + (i < here ? i : 0)]);
    }
    const std::uint32_t asked = here == 32 ? ~0u : (1u << here) - 1u;
    hidden |= hidden_lanes<Bound::kDirections>(umbras, umbra_count, load_nodes(node).bounds, asked) << first;
  }
  return hidden;
}

bool hides_any(const Umbra& umbra, const LightPlaces& places, std::uint16_t* left) {
  bool any = false;
  for (std::size_t first = 0; first < places.count; first += Lanes::kCount) {
    std::uint16_t& word = left[first / kPacketSize];
    const auto shift = static_cast<unsigned>(first % kPacketSize);
    std::uint32_t lanes = std::uint32_t{word} >> shift & Lanes::kAllBits;
    if (lanes == 0) continue;
    const Batch x = Batch::load_unaligned(places.x + first), y = Batch::load_unaligned(places.y + first),
                z = Batch::load_unaligned(places.z + first);
    for (int plane = kUmbraPlanes - 1; plane >= 0 && lanes != 0; --plane) {
      const HalfSpace& h = umbra.behind[plane];
      const Batch inside = x * Batch(h.normal.x) + y * Batch(h.normal.y) + z * Batch(h.normal.z);
      lanes &= bits(Mask{inside > Batch(places.directions ? kUmbraDirectionSlack : -h.offset)});
    }
    word = static_cast<std::uint16_t>(word & ~(lanes << shift));
    any = any || lanes != 0;
  }
  return any;
}

constexpr int kPairs = Lanes::kCount / 2;
static_assert(kPairs <= kMostPairs);

LC_LANES_FN void wait(GroupWalk& walk, std::uint32_t node, std::uint32_t kept) {
  const LightNode* child = &walk.nodes[walk.nodes[node].first_child];
  __builtin_prefetch(child);
  __builtin_prefetch(child + 1);
  walk.waiting[walk.waiting_count++] = {node, kept};
}

/// Takes nodes to go below from the stack, then from the feed; returns how many.
LC_LANES_FN int take(GroupWalk& walk, WaitingNode* taken) {
  const int most = walk.waiting_count > kWideWalk ? 1 : kPairs;
  int count = 0;
  while (count < most && walk.waiting_count > 0) taken[count++] = walk.waiting[--walk.waiting_count];
  while (count < most && walk.feed_count > 0) taken[count++] = walk.feed[--walk.feed_count];
  return count;
}

template <class Bound>
std::uint32_t walk_on(GroupWalk& walk, ChosenNode* chosen, std::uint32_t capacity) {
  const ReceiverGroup<BoundLanes> group = broadcast_group(walk.group);
  const BoundVec3 weights = broadcast_bound(walk.weights);
  std::uint32_t chosen_count = 0;
  while (chosen_count + 2 * kMostPairs <= capacity) {
    WaitingNode taken[kPairs];
    const int count = take(walk, taken);
    if (count == 0) break;
    walk.visits += 2 * static_cast<std::uint64_t>(count);
    const LightNode* pairs[kPairs];
    for (int i = 0; i < kPairs; ++i) pairs[i] = &walk.nodes[walk.nodes[taken[i < count ? i : 0].node].first_child];

    // Bounds of all children. One that is not a number or infinite is refused.
    const NodeLanes nodes = load_pairs(pairs);
    const BoundLanes geometric = Bound::geometric(group, nodes.bounds, walk.min_distance_sq);
    const BoundLanes power = dot(weights, nodes.intensity);
    const BatchBool small = (power * geometric).value <= Batch(1.0f);
    const BatchBool dark = geometric.value <= Batch(0.0f);
    const std::uint32_t accepted = bits(Mask{small | dark});
    alignas(64) float bound[Lanes::kCount];
    geometric.value.store_aligned(bound);
    std::uint32_t hidden = 0;
    if (walk.umbra_count > 0) {
      const std::uint32_t asked = ~bits(Mask{dark}) & static_cast<std::uint32_t>((std::uint64_t{1} << 2 * count) - 1);
      hidden = hidden_lanes<Bound::kDirections>(walk.umbras, walk.umbra_count, nodes.bounds, asked);
    }

    for (int i = 0; i < count; ++i) {
      // The child with fewer leaves comes next, so the other one waits below it.
      const bool second_larger = pairs[i][1].leaf_count >= pairs[i][0].leaf_count;
      for (int turn = 0; turn < 2; ++turn) {
        const int child = (turn == 0) == second_larger ? 1 : 0;
        const int lane = 2 * i + child;
        const std::uint32_t index = walk.nodes[taken[i].node].first_child + static_cast<std::uint32_t>(child);
        const std::uint32_t kept = child == 0 ? taken[i].kept : kNone;
        if ((hidden >> lane & 1u) != 0) {
          if (walk.tell_hidden) chosen[chosen_count++] = {index, kept, kHidden};
        } else if (pairs[i][child].is_leaf()) {
          chosen[chosen_count++] = {index, kept, 0.0f};
        } else if ((accepted >> lane & 1u) != 0) {
          chosen[chosen_count++] = {index, kept, bound[lane]};
        } else {
          wait(walk, index, kept);
        }
      }
    }
  }
  return chosen_count;
}

// --- Light of what was chosen: one receiver a lane ---

template <bool Flat>
LC_LANES_FN Receiver<Lanes, Flat> load_receiver(const ReceiverPacket& packet, int first) {
  Receiver<Lanes, Flat> receiver;
  receiver.position = load(packet.position, first);
  receiver.ns = load(packet.ns, first);
  if constexpr (!Flat) receiver.ng = load(packet.ng, first);
  return receiver;
}

/// Light and largest bound of up to one register of receivers.
struct LaneSum {
  LanesVec3 light = broadcast(Vec3{});
  Lanes largest{0.0f};

  LC_LANES_FN void add(const CutLight& from, const LanesVec3& weights, Lanes factor) {
    const LanesVec3 intensity = broadcast(from.intensity);
    light += intensity * factor;
    largest = max_of(largest, dot(weights, intensity) * Lanes(from.bound));
  }
  LC_LANES_FN void store(CutSum& out, int first) const {
    light.x.store(out.sum.light.x + first);
    light.y.store(out.sum.light.y + first);
    light.z.store(out.sum.light.z + first);
    largest.store(out.largest + first);
  }
};

LC_LANES_FN Lanes share_of(const CutTask& task, std::size_t i, int first) {
  return Lanes::load(task.shares[i].of + first);
}

/// Luminance that the clamp took from some receivers: rare, so apart from the sum.
LC_LANES_FN void sum_loss(const CutTask& task, float min_distance_sq, int first, CutSum& out) {
  const Lanes clamp_sq(min_distance_sq);
  const Receiver<Lanes, false> receiver = load_receiver<false>(task.receivers, first);
  Lanes lost(0.0f);
  for (std::size_t i = 0; i < task.count; ++i) {
    const CutLight& from = task.lights[i];
    const VplFactor<Lanes> factor = vpl_factor(receiver, broadcast(from.position), broadcast(from.axis), clamp_sq);
    Lanes taken = select(factor.distance_sq < clamp_sq, factor.unclamped - factor.clamped, Lanes(0.0f));
    if (task.shares != nullptr) taken = taken * share_of(task, i, first);
    lost = lost + taken * Lanes(luminance(from.intensity));
  }
  lost.store(out.sum.lost + first);
}

template <bool Flat, bool Shaded>
LC_LANES_FN void sum_vpls_of(const CutTask& task, float min_distance_sq, CutSum& out) {
  const Lanes clamp_sq(min_distance_sq);
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes, Flat> receiver = load_receiver<Flat>(task.receivers, first);
    const LanesVec3 weights = load(task.weights, first);
    LaneSum sum;
    Lanes nearest_sq(std::numeric_limits<float>::max());
    for (std::size_t i = 0; i < task.count; ++i) {
      const CutLight& from = task.lights[i];
      const VplFactor<Lanes> factor = vpl_factor(receiver, broadcast(from.position), broadcast(from.axis), clamp_sq);
      nearest_sq = min_of(factor.distance_sq, nearest_sq);
      if constexpr (Shaded) {
        sum.add(from, weights, factor.clamped * share_of(task, i, first));
      } else {
        sum.add(from, weights, factor.clamped);
      }
    }
    sum.store(out, first);
    Lanes(0.0f).store(out.sum.lost + first);
    if (bits(nearest_sq < clamp_sq) != 0) sum_loss(task, min_distance_sq, first, out);
  }
}

void sum_vpls(const CutTask& task, float min_distance_sq, CutSum& out) {
  if (task.shares != nullptr) {
    sum_vpls_of<false, true>(task, min_distance_sq, out);
  } else if (task.receivers.flat) {
    sum_vpls_of<true, false>(task, min_distance_sq, out);
  } else {
    sum_vpls_of<false, false>(task, min_distance_sq, out);
  }
}

/// The same for lights without a clamp; `factor_of(receiver, record)` is theirs.
template <class Record, class Factor>
LC_LANES_FN void sum_unclamped(const CutTask& task, const Record* records, CutSum& out, Factor factor_of) {
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const Receiver<Lanes> receiver = load_receiver<false>(task.receivers, first);
    const LanesVec3 weights = load(task.weights, first);
    LaneSum sum;
    for (std::size_t i = 0; i < task.count; ++i) {
      const CutLight& from = task.lights[i];
      Lanes factor = factor_of(receiver, records[from.light]);
      if (task.shares != nullptr) factor = factor * share_of(task, i, first);
      sum.add(from, weights, factor);
    }
    sum.store(out, first);
    Lanes(0.0f).store(out.sum.lost + first);
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

void sum_points(const CutTask& task, const PointRecord* points, CutSum& out) {
  sum_unclamped(task, points, out, PointFactor{});
}

void sum_directionals(const CutTask& task, const DirectionalRecord* lights, CutSum& out) {
  sum_unclamped(task, lights, out, DirectionalFactor{});
}

}  // namespace

extern const CutKernels cut_kernels;
const CutKernels cut_kernels{{walk_on<VplBound>, walk_on<PointBound>, walk_on<DirectionalBound>},
                             {hidden_of<VplBound>, hidden_of<PointBound>, hidden_of<DirectionalBound>},
                             hides_any,
                             sum_vpls,
                             sum_points,
                             sum_directionals};

}  // namespace lightcuts::LC_ISA
