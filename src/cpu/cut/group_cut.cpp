#include "cpu/cut/group_cut.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "cpu/cut/arrivals.h"
#include "cpu/cut/cut_light.h"
#include "cpu/cut/hidden_lights.h"
#include "cpu/cut/pixels_of_group.h"
#include "kernels/light.h"

namespace lightcuts {
namespace {

/// Leaves whose light is added together.
constexpr std::size_t kBlock = 256;
/// Nodes that a walk hands over at a time.
constexpr std::uint32_t kChosenBlock = 256;
/// Threshold of a round relative to what the total found allows.
constexpr double kNextCaution = 0.98;
/// A threshold sinks at most by this factor from one round to the next: early totals may be far too small.
constexpr double kLargestDrop = 16;
/// Rounds of a pixel after which its threshold is 0: every light counts by itself, which keeps any promise.
constexpr int kMostRounds = 24;
/// A guess is at least this share of what all lights would give at the distance of the scene's extent.
constexpr double kSmallestGuess = 1e-3;
/// More nodes of a first round than this come of a guess that is far too low, and no node ever leaves a cut: the round is
/// made again with a threshold that is higher by kDoubt.
constexpr std::size_t kMostAtFirst = 512;
constexpr float kDoubt = 8;
constexpr int kMostDoubts = 8;

float root_bound(LightKind kind, const ReceiverGroup<float>& group, const LightNode& node, float min_distance_sq) {
  const ClusterBounds<float> bounds{node.box.lo, node.box.hi, node.axis, node.cos_half_angle};
  switch (kind) {
    case LightKind::vpl:
      return group_vpl_bound(group, bounds, min_distance_sq);
    case LightKind::point:
      return group_point_bound(group, bounds, kPointGuardSq);
    case LightKind::directional:
      return group_directional_bound(group, bounds);
  }
  return kInfinity;
}

/// What a node's bound weighs where 1 is the threshold; infinite where it is not a number.
float weigh(Vec3 weights, Vec3 intensity, float bound) {
  const float power = dot(weights, intensity);
  const bool finite = luminance(intensity) <= std::numeric_limits<float>::max();
  const float value = finite && !(bound > 0) ? 0.0f : power * bound;
  return value <= std::numeric_limits<float>::max() ? value : kInfinity;
}

class GroupCut {
 public:
  GroupCut(const CutTools& tools, std::span<const SurfacePacket> tile, const PixelGroup& group, double extent_sq,
           const UmbraFinder& umbras, CutScratch& scratch, TileLight& out)
      : tools_(tools),
        context_(tools.context),
        group_(group),
        scratch_(scratch),
        out_(out),
        extent_sq_(extent_sq),
        pixels_(tile, group),
        arrivals_(context_, tools.shade, tile, group, pixels_, out) {
    walk_.group = bound_receivers(tile, group);
    walk_.min_distance_sq = context_.min_distance_sq;
    walk_.visits = 0;
    umbras.find(walk_.group);
    walk_.umbras = scratch.umbras.umbras.data();
    walk_.umbra_count = static_cast<std::uint32_t>(scratch.umbras.umbras.size());
    walk_.tell_hidden = tools.listener != nullptr;
  }

  void run() {
    guess();
    start();
    for (bool first = true; pixels_.any_pending(); first = false) {
      const Aim aim = pixels_.aim(tools_.tuning.level_ratio);
      walk_.weights = aim.weights;
      bool full = false;
      if (context_.max_cut > 0) {
        full = fill_up();
      } else if (first) {
        start_round();
      } else {
        for (const LightKind kind : kLightKinds) refine(kind);
      }
      for (int p = 0; p < pixels_.packet_count(); ++p) {
        if (pixels_.pending(p) != 0 && (full || (aim.packets >> p & 1u) != 0)) sum_entries(p);
      }
      finish(full ? ~0u : aim.packets, full);
      ++scratch_.rounds;
    }
    scratch_.visits += walk_.visits;
    ++scratch_.groups;
  }

 private:
  [[nodiscard]] const LightTree& tree(LightKind kind) const { return tree_of(context_.trees, kind); }

  // --- Setting out ---

  /// A first threshold from a few bright nodes, all of their light arriving.
  void guess() {
    Vec3T<double> all{0, 0, 0};
    for (const LightKind kind : kLightKinds) {
      if (tree(kind).nodes.empty()) continue;
      const Vec3 sum = tree(kind).nodes[0].intensity;
      const double share = kind == LightKind::directional ? kSmallestGuess : kSmallestGuess / extent_sq_;
      all += Vec3T<double>{sum.x, sum.y, sum.z} * share;
    }
    for (int p = 0; p < pixels_.packet_count(); ++p) {
      for (const LightKind kind : kLightKinds) {
        const std::vector<CutLight>& lights = p == 0 ? seen_frontier(kind) : scratch_.entries[index(kind)].lights;
        add(p, {kind, lights.data(), nullptr, lights.size()});
      }
    }
    const double factor = tools_.tuning.first_factor * tools_.guess_scale;
    pixels_.for_each_pending([&](int i) {
      PixelState& pixel = pixels_[i];
      const double most = std::numeric_limits<float>::max();
      const double total = std::min(std::max(pixels_.reflected(i, pixel.light), pixels_.reflected(i, all)), most);
      pixel.threshold = factor * context_.threshold(total);
    });
  }

  /// The nodes of the frontier that are not known to be hidden.
  const std::vector<CutLight>& seen_frontier(LightKind kind) {
    const std::vector<CutLight>& all = tools_.frontier.lights[index(kind)];
    std::vector<CutLight>& seen = scratch_.entries[index(kind)].lights;
    seen.clear();
    for (std::size_t first = 0; first < all.size(); first += kPacketSize) {
      const LightNode* nodes[kPacketSize];
      const int count = static_cast<int>(std::min<std::size_t>(kPacketSize, all.size() - first));
      for (int i = 0; i < count; ++i) nodes[i] = &tree(kind).nodes[all[first + static_cast<std::size_t>(i)].node];
      const std::uint32_t hidden =
          walk_.umbra_count == 0 ? 0 : tools_.cut.hidden[index(kind)](walk_.umbras, walk_.umbra_count, nodes, count);
      for (int i = 0; i < count; ++i) {
        if ((hidden >> i & 1u) == 0) seen.push_back(all[first + static_cast<std::size_t>(i)]);
      }
    }
    return seen;
  }

  void start() {
    scratch_.leaves.clear();  // a lookup that found no room for its map may have ended the last cut halfway
    for (const LightKind kind : kLightKinds) {
      CutEntries& entries = scratch_.entries[index(kind)];
      entries.clear();
      if (tree(kind).nodes.empty()) continue;
      const LightNode& root = tree(kind).nodes[0];
      if (root.is_leaf()) {
        choose(kind, {0, kNone, 0});
        add_leaves(kind);
      } else {
        const float bound = root_bound(kind, walk_.group, root, context_.min_distance_sq);
        entries.lights.push_back(cut_light(context_, kind, 0, bound));
      }
    }
  }

  // --- Rounds ---

  /// Splits the nodes whose bound is too large.
  void refine(LightKind kind) {
    CutEntries& old = scratch_.old[index(kind)];
    CutEntries& entries = scratch_.entries[index(kind)];
    if (entries.lights.empty()) return;
    std::swap(old, entries);
    entries.clear();
    scratch_.feed.clear();
    for (std::uint32_t i = 0; i < old.lights.size(); ++i) {
      const CutLight& light = old.lights[i];
      const std::uint32_t kept = i < old.asked ? i : kNone;
      if (weigh(walk_.weights, light.intensity, light.bound) <= 1) {
        keep(kind, light, kept);
      } else {
        scratch_.feed.push_back({light.node, kept});
      }
    }
    go_below(kind, [&](const ChosenNode& chosen) { choose(kind, chosen); });
    add_leaves(kind);
  }

  template <class Visit>
  void go_below(LightKind kind, Visit visit) {
    ChosenNode chosen[kChosenBlock];
    walk_.nodes = tree(kind).nodes.data();
    walk_.feed = scratch_.feed.data();
    walk_.feed_count = static_cast<std::uint32_t>(scratch_.feed.size());
    walk_.waiting_count = 0;
    while (walk_.feed_count > 0 || walk_.waiting_count > 0) {
      const std::uint32_t count = tools_.cut.walk[index(kind)](walk_, chosen, kChosenBlock);
      std::for_each(chosen, chosen + count, visit);
    }
  }

  /// The first round, again with higher thresholds where the guess is not to be trusted.
  void start_round() {
    for (int doubts = 0; !find_first(doubts < kMostDoubts ? kMostAtFirst : ~std::size_t{0}); ++doubts) {
      pixels_.for_each_pending([&](int i) { pixels_[i].threshold *= kDoubt; });
      walk_.weights *= 1 / kDoubt;
    }
    for (const LightKind kind : kLightKinds) take_first(kind);
  }

  /// Finds the nodes below the roots; false where there are more than `most`.
  bool find_first(std::size_t most) {
    std::size_t count = 0;
    for (const LightKind kind : kLightKinds) {
      std::vector<ChosenNode>& found = scratch_.first[index(kind)];
      found.clear();
      const CutEntries& entries = scratch_.entries[index(kind)];
      if (entries.lights.empty()) continue;
      const CutLight& root = entries.lights[0];
      if (weigh(walk_.weights, root.intensity, root.bound) <= 1) {
        found.push_back({0, kNone, root.bound});
        continue;
      }
      scratch_.feed.assign(1, {0, kNone});
      go_below(kind, [&](const ChosenNode& chosen) {
        found.push_back(chosen);
        if (++count > most) walk_.feed_count = walk_.waiting_count = 0;
      });
      if (count > most) return false;
    }
    return true;
  }

  void take_first(LightKind kind) {
    CutEntries& entries = scratch_.entries[index(kind)];
    if (entries.lights.empty()) return;
    entries.clear();
    for (const ChosenNode& chosen : scratch_.first[index(kind)]) choose(kind, chosen);
    add_leaves(kind);
  }

  /// Splits the nodes with the largest bounds until none is too large or the cut is full; returns whether it is.
  bool fill_up() {
    std::vector<SplitCandidate>& heap = scratch_.heap;
    const auto less = [](const SplitCandidate& a, const SplitCandidate& b) { return a.value < b.value; };
    heap.clear();
    for (const LightKind kind : kLightKinds) {
      CutEntries& old = scratch_.old[index(kind)];
      std::swap(old, scratch_.entries[index(kind)]);
      scratch_.entries[index(kind)].clear();
      for (std::uint32_t i = 0; i < old.lights.size(); ++i) {
        const CutLight& light = old.lights[i];
        const std::uint32_t kept = i < old.asked ? i : kNone;
        heap.push_back({weigh(walk_.weights, light.intensity, light.bound), kind, {light.node, kept, light.bound}});
      }
    }
    std::make_heap(heap.begin(), heap.end(), less);

    const Vec3 aimed = walk_.weights;
    walk_.weights = {0, 0, 0};  // children are taken as they come
    std::uint64_t size = leaf_count_ + heap.size();
    while (!heap.empty() && heap.front().value > 1 && size < context_.max_cut) {
      // Several at once while there is room: hardly one of their children would have come before the last of them.
      const LightKind kind = heap.front().kind;
      const std::uint64_t most = std::clamp<std::uint64_t>((context_.max_cut - size) / 8, 1, kMostPairs);
      scratch_.feed.clear();
      while (scratch_.feed.size() < most && !heap.empty() && heap.front().value > 1 && heap.front().kind == kind) {
        std::pop_heap(heap.begin(), heap.end(), less);
        scratch_.feed.push_back({heap.back().node.node, heap.back().node.kept});
        heap.pop_back();
      }
      size += scratch_.feed.size();
      go_below(kind, [&](const ChosenNode& chosen) {
        const LightNode& node = tree(kind).nodes[chosen.node];
        if (node.is_leaf() || chosen.bound < 0) {
          choose(kind, chosen);
        } else {
          heap.push_back({weigh(aimed, node.intensity, chosen.bound), kind, chosen});
          std::push_heap(heap.begin(), heap.end(), less);
        }
      });
      add_leaves(kind);
    }
    for (const SplitCandidate& c : heap) choose(c.kind, c.node);
    arrivals_.ask_waiting();
    return size >= context_.max_cut;
  }

  // --- Nodes of the cut ---

  /// An inner node stays in the cut.
  void keep(LightKind kind, const CutLight& light, std::uint32_t kept) {
    CutEntries& entries = scratch_.entries[index(kind)];
    entries.lights.push_back(light);
    if (context_.visibility != nullptr) arrivals_.ask(kind, light.light, kept, scratch_.old[index(kind)], entries);
  }

  void choose(LightKind kind, const ChosenNode& chosen) {
    if (chosen.bound < 0) {
      tell_hidden(kind, chosen.node);
      return;
    }
    const CutLight light = cut_light(context_, kind, chosen.node, chosen.bound);
    if (!tree(kind).nodes[chosen.node].is_leaf()) {
      keep(kind, light, chosen.kept);
      return;
    }
    CutEntries& leaves = scratch_.leaves;
    leaves.lights.push_back(light);
    if (context_.visibility != nullptr) {
      arrivals_.ask(kind, light.light, chosen.kept, scratch_.old[index(kind)], leaves);
    }
    if (leaves.lights.size() == kBlock) add_leaves(kind);
  }

  void tell_hidden(LightKind kind, std::uint32_t node) {
    std::uint8_t pixels[kTilePixels];
    std::size_t count = 0;
    pixels_.for_each_pending([&](int i) { pixels[count++] = group_.pixels[i]; });
    tools_.listener->hidden(kind, node, walk_.group, {pixels, count});
  }

  // --- Light ---

  void add(int packet, const LitNodes& nodes) { out_.pairs += pixels_.add(packet, nodes, context_, tools_.cut); }

  [[nodiscard]] LitNodes lit(LightKind kind, int packet, const CutEntries& nodes) const {
    const PacketShare* shares = nodes.shares[static_cast<std::size_t>(packet)].data();
    return {kind, nodes.lights.data(), context_.visibility == nullptr ? nullptr : shares, nodes.lights.size()};
  }

  void sum_entries(int packet) {
    pixels_.start_from_leaves(packet);
    for (const LightKind kind : kLightKinds) add(packet, lit(kind, packet, scratch_.entries[index(kind)]));
  }

  /// Leaves never leave the cut again: they go into the pixels' fixed sums and are forgotten.
  void add_leaves(LightKind kind) {
    arrivals_.ask_waiting();
    CutEntries& leaves = scratch_.leaves;
    if (leaves.lights.empty()) return;
    for (int p = 0; p < pixels_.packet_count(); ++p) {
      if (pixels_.pending(p) == 0) continue;
      pixels_.start_from_nothing(p);
      add(p, lit(kind, p, leaves));
      pixels_.keep_as_leaves(p);
    }
    std::uint8_t pixels[kTilePixels];
    std::size_t count = 0;
    pixels_.for_each_pending([&](int i) { pixels[count++] = group_.pixels[i]; });
    report(kind, leaves, {pixels, count});
    leaf_count_ += leaves.lights.size();
    leaves.clear();
  }

  void report(LightKind kind, const CutEntries& nodes, std::span<const std::uint8_t> pixels) const {
    for (const CutLight& light : nodes.lights) context_.marks.set(kind, light.light);
    if (tools_.listener == nullptr) return;
    for (const CutLight& light : nodes.lights) tools_.listener->chosen(kind, light.node, walk_.group, pixels);
  }

  /// Pixels of the packets given for which the promise holds, or all, leave with what they have; others get new thresholds.
  void finish(std::uint32_t packets, bool all) {
    std::uint64_t size = leaf_count_;
    for (const CutEntries& entries : scratch_.entries) size += entries.lights.size();
    std::uint8_t done[kTilePixels];
    std::size_t done_count = 0;
    pixels_.for_each_pending([&](int i) {
      if ((packets >> (i / kPacketSize) & 1u) == 0) return;
      PixelState& pixel = pixels_[i];
      amplify(pixel);
      pixel.total = pixels_.reflected(i, pixel.light);
      // Beyond the last round there are only lights left that are too weak for a weight to tell from nothing.
      if (!all && pixel.rounds <= kMostRounds && pixel.largest > context_.threshold(pixel.total)) {
        const double wanted = kNextCaution * context_.threshold(pixel.total);
        const double lowest = std::min<double>(pixel.threshold, pixel.largest) / kLargestDrop;
        pixel.threshold = pixel.rounds >= kMostRounds ? 0 : std::max(wanted, lowest);
        return;
      }
      const std::uint8_t at = group_.pixels[i];
      out_.light[at] = pixel.light;
      out_.lost[at] = pixel.lost;
      if (tools_.listener != nullptr) tools_.listener->lit(at, pixel.fixed);
      record_cut(out_, at, size, pixel.largest, pixel.total, context_);
      done[done_count++] = at;
      pixels_.leave(i);
    });
    if (done_count == 0) return;
    for (const LightKind kind : kLightKinds) report(kind, scratch_.entries[index(kind)], {done, done_count});
  }

  /// Multiplies the light of inner nodes by the gain. What a node is off by grows at most as its bound does.
  void amplify(PixelState& pixel) const {
    const Vec3T<double> inner = pixel.light - pixel.fixed;
    if (context_.gain == 1 || !std::isfinite(luminance(inner))) return;
    pixel.light = pixel.fixed + inner * context_.gain;
    pixel.largest *= static_cast<float>(std::max(context_.gain, 1.0));
  }

  const CutTools& tools_;
  const CutContext& context_;
  const PixelGroup& group_;
  CutScratch& scratch_;
  TileLight& out_;
  double extent_sq_;
  GroupPixels pixels_;
  Arrivals arrivals_;
  std::uint64_t leaf_count_ = 0;
  GroupWalk walk_;
};

Box box_of(std::span<const SurfacePacket> packets) {
  Box box;
  for (const SurfacePacket& packet : packets) {
    const PacketVec3& at = packet.receivers.position;
    for (std::uint32_t lanes = packet.receivers.active; lanes != 0; lanes &= lanes - 1) {
      const int lane = std::countr_zero(lanes);
      box = extend(box, Vec3{at.x[lane], at.y[lane], at.z[lane]});
    }
  }
  return box;
}

/// Diagonal of the box around lights and receivers [m].
double extent_of(const LightTrees& trees, Box receivers) {
  if (!trees.vpls.nodes.empty()) receivers = extend(receivers, trees.vpls.nodes[0].box);
  if (!trees.points.nodes.empty()) receivers = extend(receivers, trees.points.nodes[0].box);
  return std::max(static_cast<double>(diagonal(receivers)), 1e-9);
}

}  // namespace

void cut_pixels(const CutTools& tools, std::span<const SurfacePacket> packets, CutScratch& scratch, TileLight& out) {
  const Box receivers = box_of(packets);
  const double extent = extent_of(tools.context.trees, receivers);
  const GroupLimits limits{static_cast<float>(tools.tuning.extent * extent), tools.tuning.cosine, tools.tuning.pixels};
  const UmbraFinder umbras(tools.context, tools.frontier, tools.cut, receivers, tools.tuning.umbras, scratch.umbras);
  for (const PixelGroup& group : group_pixels(packets, limits)) {
    GroupCut(tools, packets, group, extent * extent, umbras, scratch, out).run();
  }
}

}  // namespace lightcuts
