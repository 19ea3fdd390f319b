#include "cpu/cut/packet_cut.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace lightcuts {

Frontier make_frontier(const LightTrees& trees, std::uint32_t size) {
  constexpr std::uint32_t all_lanes = (1u << kPacketSize) - 1;
  Frontier frontier;
  for (const LightKind kind : kLightKinds) {
    const std::vector<LightNode>& nodes = tree_of(trees, kind).nodes;
    if (nodes.empty()) continue;
    const auto dimmer = [&](std::uint32_t a, std::uint32_t b) {
      const auto power = [&](std::uint32_t n) { return nodes[n].is_leaf() ? -1.0f : luminance(nodes[n].intensity); };
      return power(a) < power(b);
    };
    std::vector<std::uint32_t> heap{0};
    while (heap.size() < size && !nodes[heap.front()].is_leaf()) {
      std::pop_heap(heap.begin(), heap.end(), dimmer);
      const LightNode& brightest = nodes[heap.back()];
      heap.back() = brightest.first_child;
      std::push_heap(heap.begin(), heap.end(), dimmer);
      heap.push_back(brightest.second_child());
      std::push_heap(heap.begin(), heap.end(), dimmer);
    }
    for (const std::uint32_t node : heap) frontier.nodes[static_cast<std::size_t>(kind)].push_back({node, all_lanes});
  }
  return frontier;
}

namespace {

/// Nodes chosen before they are shaded: so few that their sum in single precision loses nothing that matters.
constexpr std::uint32_t kChosenBlock = 256;
/// Threshold of a first walk relative to its guess: guesses that are a little too high do no harm then.
constexpr double kFirstCaution = 0.9;
/// The same once a cut's total is known.
constexpr double kNextCaution = 0.98;
/// A threshold sinks at most by this factor from one walk to the next: where hardly any light arrives, the last walk
/// then costs about as much as all before.
constexpr double kLargestDrop = 16;
/// Walks after which a threshold is 0: every light counts by itself, which keeps any promise.
constexpr int kMostRounds = 16;

float finite_float(double v) {
  return static_cast<float>(std::min(v, static_cast<double>(std::numeric_limits<float>::max())));
}

template <class Visit>
void for_each_lane(std::uint32_t lanes, Visit visit) {
  for (; lanes != 0; lanes &= lanes - 1) visit(std::countr_zero(lanes));
}

class PacketCut {
 public:
  PacketCut(const PacketTools& tools, const SurfacePacket& packet, PacketLight& out)
      : tools_(tools), context_(tools.context), packet_(packet), receivers_(packet.receivers), out_(out) {
    for (int lane = 0; lane < kPacketSize; ++lane) {
      const Vec3 w = reflected_weights({packet.albedo.x[lane], packet.albedo.y[lane], packet.albedo.z[lane]});
      walk_.weights.x[lane] = w.x;
      walk_.weights.y[lane] = w.y;
      walk_.weights.z[lane] = w.z;
    }
    walk_.min_distance_sq = context_.min_distance_sq;
    walk_.visits = 0;
  }

  void run(Arrival& arrival) {
    double guess[kPacketSize], unshadowed[kPacketSize];
    guess_totals(arrival, guess, unshadowed);
    std::uint32_t pending = receivers_.active;
    for_each_lane(pending, [&](int lane) { threshold_[lane] = kFirstCaution * context_.threshold(guess[lane]); });
    for (int round = 1; pending != 0; ++round) {
      const std::uint32_t limited = context_.max_cut > 0 ? fit(pending) : 0;
      light(pending);
      pending = unkept(pending & ~limited);
      for_each_lane(pending, [&](int lane) { lower_threshold(lane, round); });
      ++out_.rounds;
    }
    out_.visits = walk_.visits;
    learn(arrival, unshadowed);
  }

 private:
  const LightTree& tree(LightKind kind) const { return tree_of(context_.trees, kind); }
  static std::size_t index(LightKind kind) { return static_cast<std::size_t>(kind); }

  // --- The guess ---

  void guess_totals(const Arrival& arrival, double* guess, double* unshadowed) {
    PacketLight first;
    sum_frontier(nullptr, first);
    std::copy(first.total, first.total + kPacketSize, unshadowed);
    std::copy(first.total, first.total + kPacketSize, guess);
    if (context_.visibility == nullptr) return;
    if (arrival.ratio >= 0) {
      for_each_lane(receivers_.active, [&](int lane) { guess[lane] *= arrival.ratio; });
      return;
    }
    PacketLight seen;
    sum_frontier(context_.visibility, seen);
    out_.rays += seen.rays;
    out_.pairs += seen.pairs;
    for_each_lane(receivers_.active, [&](int lane) { guess[lane] = std::max(seen.total[lane], guess[lane] / 64); });
  }

  void sum_frontier(const PacketVisibility* visibility, PacketLight& result) {
    for (const LightKind kind : kLightKinds) {
      const std::vector<ChosenNode>& nodes = tools_.frontier.nodes[index(kind)];
      for (std::size_t first = 0; first < nodes.size(); first += kChosenBlock) {
        shade(kind, &nodes[first], std::min<std::size_t>(kChosenBlock, nodes.size() - first), visibility, result);
      }
    }
    total_up(receivers_.active, result);
  }

  void learn(Arrival& arrival, const double* unshadowed) const {
    double got = 0, offered = 0;
    for_each_lane(receivers_.active, [&](int lane) {
      got += out_.total[lane];
      offered += unshadowed[lane];
    });
    if (offered > 0) arrival.ratio = std::max(got / offered, 1.0 / 64);
  }

  // --- A walk ---

  /// Sends lanes through all trees with their thresholds; calls visit(kind, chosen, count) for each block of nodes.
  template <class Visit>
  void walk(std::uint32_t lanes, float size_limit, Visit visit) {
    walk_.size_limit = size_limit;
    for (int lane = 0; lane < kPacketSize; ++lane) {
      walk_.threshold[lane] = finite_float(threshold_[lane]);
      walk_.largest[lane] = 0;
      walk_.size[lane] = 0;
    }
    ChosenNode chosen[kChosenBlock];
    for (const LightKind kind : kLightKinds) {
      if (tree(kind).nodes.empty()) continue;
      walk_.nodes = tree(kind).nodes.data();
      if (tools_.cut.start[index(kind)](receivers_, walk_, lanes, chosen) > 0) visit(kind, chosen, std::size_t{1});
      while (walk_.waiting_count > 0) {
        const std::uint32_t count = tools_.cut.walk[index(kind)](receivers_, walk_, chosen, kChosenBlock);
        if (count > 0) visit(kind, chosen, std::size_t{count});
      }
    }
  }

  void light(std::uint32_t lanes) {
    for_each_lane(lanes, [&](int lane) {
      out_.light[lane] = {};
      out_.lost[lane] = 0;
    });
    if (tools_.listener != nullptr) tools_.listener->start(lanes);
    walk(lanes, std::numeric_limits<float>::max(), [&](LightKind kind, const ChosenNode* chosen, std::size_t count) {
      shade(kind, chosen, count, context_.visibility, out_);
      for (const ChosenNode* c = chosen; c != chosen + count; ++c) {
        context_.marks.set(kind, walk_.nodes[c->node].representative);
        if (tools_.listener != nullptr) tools_.listener->chosen(kind, *c);
      }
    });
    total_up(lanes, out_);
    for_each_lane(lanes, [&](int lane) {
      out_.largest_bound[lane] = walk_.largest[lane];
      out_.size[lane] = walk_.size[lane];
    });
  }

  [[nodiscard]] std::uint32_t unkept(std::uint32_t lanes) const {
    std::uint32_t result = 0;
    for_each_lane(lanes, [&](int lane) {
      if (out_.largest_bound[lane] > context_.threshold(out_.total[lane])) result |= 1u << lane;
    });
    return result;
  }

  void lower_threshold(int lane, int round) {
    const double wanted = kNextCaution * context_.threshold(out_.total[lane]);
    threshold_[lane] = round >= kMostRounds ? 0 : std::max(wanted, threshold_[lane] / kLargestDrop);
  }

  // --- A largest cut ---

  /// Lanes whose cut, chosen with the present thresholds, would be larger than allowed.
  std::uint32_t too_large(std::uint32_t lanes) {
    const auto limit = static_cast<float>(context_.max_cut);
    walk(lanes, limit, [](LightKind, const ChosenNode*, std::size_t) {});
    std::uint32_t result = 0;
    for_each_lane(lanes, [&](int lane) {
      if (walk_.size[lane] > limit) result |= 1u << lane;
    });
    return result;
  }

  /// Raises thresholds until cuts fit; returns the lanes for which it had to.
  std::uint32_t fit(std::uint32_t lanes) {
    const std::uint32_t large = too_large(lanes);
    if (large == 0) return 0;
    double below[kPacketSize], above[kPacketSize];
    for_each_lane(large, [&](int lane) {
      below[lane] = threshold_[lane];
      above[lane] = threshold_[lane] = start_above(lane);
    });
    // From some threshold on, the cut is the roots alone: that one fits, or nothing does.
    for (std::uint32_t growing = large; growing != 0;) {
      const std::uint32_t still = too_large(growing);
      for_each_lane(still, [&](int lane) {
        below[lane] = above[lane];
        above[lane] *= 16;
        threshold_[lane] = above[lane];
      });
      growing = 0;
      for_each_lane(still, [&](int lane) {
        if (below[lane] < std::numeric_limits<float>::max()) growing |= 1u << lane;
      });
    }
    for (int step = 0; step < kBisections; ++step) {
      for_each_lane(large, [&](int lane) { threshold_[lane] = middle(below[lane], above[lane]); });
      const std::uint32_t still = too_large(large);
      for_each_lane(large, [&](int lane) { (still >> lane & 1u ? below : above)[lane] = threshold_[lane]; });
    }
    for_each_lane(large, [&](int lane) { threshold_[lane] = above[lane]; });
    return large;
  }

  static constexpr int kBisections = 10;

  /// Some threshold above the present one.
  double start_above(int lane) const { return std::max(threshold_[lane] * 16, 1e-30); }
  /// Between two thresholds, on a scale of ratios.
  static double middle(double below, double above) { return std::sqrt(std::max(below, above * 1e-6) * above); }

  // --- Light ---

  void shade(LightKind kind, const ChosenNode* chosen, std::size_t count, const PacketVisibility* visibility,
             PacketLight& result) {
    PacketSum sum{};
    if (visibility == nullptr) {
      sum_unshadowed(kind, chosen, count, sum);
      for (const ChosenNode* c = chosen; c != chosen + count; ++c) result.pairs += std::popcount(c->lanes);
    } else {
      for (const ChosenNode* c = chosen; c != chosen + count; ++c) add_visible(kind, *c, *visibility, sum, result);
    }
    for (int lane = 0; lane < kPacketSize; ++lane) {
      result.light[lane] += Vec3T<double>{sum.light.x[lane], sum.light.y[lane], sum.light.z[lane]};
      result.lost[lane] += sum.lost[lane];
    }
  }

  void sum_unshadowed(LightKind kind, const ChosenNode* chosen, std::size_t count, PacketSum& sum) {
    const LightNode* nodes = tree(kind).nodes.data();
    const LightSet& lights = context_.lights;
    switch (kind) {
      case LightKind::vpl:
        tools_.cut.sum_vpls(receivers_, nodes, lights.vpls.data(), chosen, count, context_.min_distance_sq, sum);
        break;
      case LightKind::point:
        tools_.cut.sum_points(receivers_, nodes, lights.points.data(), chosen, count, sum);
        break;
      case LightKind::directional:
        tools_.cut.sum_directionals(receivers_, nodes, lights.directionals.data(), chosen, count, sum);
        break;
    }
  }

  void add_visible(LightKind kind, ChosenNode chosen, const PacketVisibility& visibility, PacketSum& sum,
                   PacketLight& result) {
    const LightNode& node = tree(kind).nodes[chosen.node];
    PacketFactors factors;
    RayPacket16 rays;
    const std::uint32_t candidates = shadow_rays(kind, node.representative, factors, rays) & chosen.lanes;
    result.pairs += std::popcount(chosen.lanes);
    if (candidates == 0) return;
    alignas(64) float share[kPacketSize];
    result.rays += visibility.shares({kind, node.representative, receivers_, rays, candidates}, share);
    tools_.shade.accumulate(factors, node.intensity, share, sum);
  }

  std::uint32_t shadow_rays(LightKind kind, std::uint32_t light, PacketFactors& factors, RayPacket16& rays) const {
    const LightSet& lights = context_.lights;
    switch (kind) {
      case LightKind::vpl:
        return tools_.shade.vpl_shadow_rays(receivers_, lights.vpls[light], context_.min_distance_sq, factors, rays);
      case LightKind::point:
        return tools_.shade.point_shadow_rays(receivers_, lights.points[light], factors, rays);
      case LightKind::directional:
        return tools_.shade.directional_shadow_rays(receivers_, lights.directionals[light], factors, rays);
    }
    return 0;
  }

  void total_up(std::uint32_t lanes, PacketLight& result) const {
    for_each_lane(lanes, [&](int lane) {
      const Vec3T<double>& light = result.light[lane];
      const double total =
          walk_.weights.x[lane] * light.x + walk_.weights.y[lane] * light.y + walk_.weights.z[lane] * light.z;
      result.total[lane] = total > 0 ? total : 0;
    });
  }

  const PacketTools& tools_;
  const CutContext& context_;
  const SurfacePacket& packet_;
  const ReceiverPacket& receivers_;
  PacketLight& out_;
  PacketWalk walk_{};
  double threshold_[kPacketSize] = {};
};

}  // namespace

void cut_packet(const PacketTools& tools, const SurfacePacket& packet, Arrival& arrival, PacketLight& out) {
  if (packet.receivers.active != 0) PacketCut(tools, packet, out).run(arrival);
}

}  // namespace lightcuts
