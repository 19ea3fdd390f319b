#include "cpu/cut/group_cut.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "kernels/light.h"

namespace lightcuts {
namespace {

/// Lights added in single precision: so few that their sum loses nothing that matters.
constexpr std::size_t kBlock = 256;
/// Nodes that a walk hands over at a time.
constexpr std::uint32_t kChosenBlock = 256;
/// Threshold of a round relative to what the total found allows.
constexpr double kNextCaution = 0.98;
/// A threshold sinks at most by this factor from one round to the next: early totals may be far too small.
constexpr double kLargestDrop = 4;
/// Rounds of a pixel after which its threshold is 0: every light counts by itself, which keeps any promise.
constexpr int kMostRounds = 24;
/// A guess is at least this share of what all lights would give at the distance of the scene's extent.
constexpr double kSmallestGuess = 1e-3;
/// Largest finite weight: an infinite one would make nonsense of clusters that are dark.
constexpr float kLargestWeight = 1e38f;

Vec3 lane_of(const PacketVec3& v, int lane) { return {v.x[lane], v.y[lane], v.z[lane]}; }
void set_lane(PacketVec3& packet, int lane, Vec3 v) {
  packet.x[lane] = v.x;
  packet.y[lane] = v.y;
  packet.z[lane] = v.z;
}

std::size_t index(LightKind kind) { return static_cast<std::size_t>(kind); }

CutLight cut_light(LightKind kind, const LightTree& tree, const LightSet& lights, std::uint32_t index, float bound) {
  const LightNode& node = tree.nodes[index];
  CutLight light{{}, bound, {}, index, node.intensity, node.representative};
  if (kind == LightKind::vpl) {
    const Vpl& vpl = lights.vpls[node.representative];
    light.position = vpl.position;
    light.axis = vpl.axis;
  }
  return light;
}

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

struct PixelState {
  double threshold = 0;
  double total = 0;                 ///< luminance of the reflected light, times pi
  Vec3T<double> light, fixed;       ///< of the cut; of its leaves
  double lost = 0, fixed_lost = 0;  ///< luminance that the clamp took
  float largest = 0;                ///< bound of a node, in the total's unit
  float weight = 0;                 ///< luminance of the albedo
  int rounds = 0;
};

class GroupCut {
 public:
  GroupCut(const CutTools& tools, std::span<const SurfacePacket> tile, const PixelGroup& group, double extent_sq,
           CutScratch& scratch, TileLight& out)
      : tools_(tools),
        context_(tools.context),
        group_(group),
        scratch_(scratch),
        out_(out),
        extent_sq_(extent_sq),
        packet_count_((group.count + kPacketSize - 1) / kPacketSize) {
    pack(tile);
    walk_.group = bound_receivers(tile, group);
    walk_.min_distance_sq = context_.min_distance_sq;
    walk_.visits = 0;
    find_umbras(context_, walk_.group, tools.tuning.umbras, scratch.umbras);
    walk_.umbras = scratch.umbras.umbras.data();
    walk_.umbra_count = static_cast<std::uint32_t>(scratch.umbras.umbras.size());
    walk_.tell_hidden = tools.listener != nullptr;
  }

  void run() {
    guess();
    start();
    while (any_pending()) {
      const std::uint32_t packets = aim();
      bool full = false;
      if (context_.max_cut > 0) {
        full = fill_up();
      } else {
        for (const LightKind kind : kLightKinds) refine(kind);
      }
      for (int p = 0; p < packet_count_; ++p) {
        if (full || (packets >> p & 1u) != 0) sum_entries(p);
      }
      finish(full ? ~0u : packets, full);
      ++scratch_.rounds;
    }
    scratch_.visits += walk_.visits;
    ++scratch_.groups;
  }

 private:
  [[nodiscard]] const LightTree& tree(LightKind kind) const { return tree_of(context_.trees, kind); }

  template <class Visit>
  void for_each_pending(Visit visit) {
    for (int p = 0; p < packet_count_; ++p) {
      for (std::uint32_t lanes = pending_[p]; lanes != 0; lanes &= lanes - 1)
        visit(p * kPacketSize + std::countr_zero(lanes));
    }
  }
  [[nodiscard]] bool any_pending() const {
    return std::any_of(pending_, pending_ + packet_count_, [](std::uint32_t lanes) { return lanes != 0; });
  }

  // --- Setting out ---

  void pack(std::span<const SurfacePacket> tile) {
    for (int p = 0; p < packet_count_; ++p) {
      ReceiverPacket& receivers = receivers_[p];
      receivers = {};
      weights_[p] = {};
      receivers.flat = true;
      const int count = std::min(kPacketSize, group_.count - p * kPacketSize);
      pending_[p] = (1u << count) - 1u;
      receivers.active = pending_[p];
      for (int lane = 0; lane < count; ++lane) {
        const std::uint8_t pixel = group_.pixels[p * kPacketSize + lane];
        const SurfacePacket& from = tile[pixel / kPacketSize];
        const int at = pixel % kPacketSize;
        const Vec3 ns = lane_of(from.receivers.ns, at), ng = lane_of(from.receivers.ng, at);
        set_lane(receivers.position, lane, lane_of(from.receivers.position, at));
        set_lane(receivers.ns, lane, ns);
        set_lane(receivers.ng, lane, ng);
        receivers.flat = receivers.flat && ns == ng;
        const Vec3 weights = reflected_weights(lane_of(from.albedo, at));
        set_lane(weights_[p], lane, weights);
        pixels_[p * kPacketSize + lane].weight = weights.x + weights.y + weights.z;
      }
    }
  }

  [[nodiscard]] double reflected(int i, const Vec3T<double>& light) const {
    const Vec3 w = lane_of(weights_[i / kPacketSize], i % kPacketSize);
    const double total = w.x * light.x + w.y * light.y + w.z * light.z;
    return total > 0 ? total : 0;
  }

  /// A first threshold from a few bright nodes, all of their light arriving.
  void guess() {
    Vec3T<double> all{0, 0, 0};
    for (const LightKind kind : kLightKinds) {
      if (tree(kind).nodes.empty()) continue;
      const Vec3 sum = tree(kind).nodes[0].intensity;
      const double share = kind == LightKind::directional ? kSmallestGuess : kSmallestGuess / extent_sq_;
      all += Vec3T<double>{sum.x, sum.y, sum.z} * share;
    }
    for (int p = 0; p < packet_count_; ++p) {
      for (const LightKind kind : kLightKinds) {
        if (p == 0) seen_frontier(kind);
        const std::vector<CutLight>& lights = scratch_.entries[index(kind)].lights;
        sum(kind, p, lights.data(), nullptr, lights.size());
      }
    }
    const double factor = tools_.tuning.first_factor * tools_.guess_scale;
    for_each_pending([&](int i) {
      PixelState& pixel = pixels_[i];
      const double most = std::numeric_limits<float>::max();
      const double total = std::min(std::max(reflected(i, pixel.light), reflected(i, all)), most);
      pixel.threshold = factor * context_.threshold(total);
    });
  }

  /// Copies the nodes of the frontier that are not hidden.
  void seen_frontier(LightKind kind) {
    const std::vector<CutLight>& all = tools_.frontier.lights[index(kind)];
    std::vector<CutLight>& seen = scratch_.entries[index(kind)].lights;
    seen.clear();
    for (std::size_t first = 0; first < all.size(); first += kPacketSize) {
      const LightNode* nodes[kPacketSize];
      const int count = static_cast<int>(std::min<std::size_t>(kPacketSize, all.size() - first));
      for (int i = 0; i < count; ++i) nodes[i] = &tree(kind).nodes[all[first + static_cast<std::size_t>(i)].node];
      const std::uint32_t hidden = tools_.cut.hidden[index(kind)](walk_.umbras, walk_.umbra_count, nodes, count);
      for (int i = 0; i < count; ++i) {
        if ((hidden >> i & 1u) == 0) seen.push_back(all[first + static_cast<std::size_t>(i)]);
      }
    }
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
        entries.lights.push_back(cut_light(kind, tree(kind), context_.lights, 0, bound));
      }
    }
  }

  // --- Rounds ---

  /// Sets the weights that nodes are tested with for the pixels that bear the largest thresholds, the others' turn coming
  /// later; returns their packets as bits.
  std::uint32_t aim() {
    double level = -1;
    const auto key = [&](int i) { return pixels_[i].threshold / pixels_[i].weight; };
    for_each_pending([&](int i) {
      if (pixels_[i].weight > 0) level = std::max(level, key(i));
    });
    Vec3 weights{0, 0, 0};
    std::uint32_t packets = 0;
    for_each_pending([&](int i) {
      const bool black = !(pixels_[i].weight > 0);
      if (!black && key(i) * tools_.tuning.level_ratio < level) return;
      packets |= 1u << (i / kPacketSize);
      ++pixels_[i].rounds;
      if (black) return;
      const Vec3 w = lane_of(weights_[i / kPacketSize], i % kPacketSize);
      const auto relative = [&](float weight) {
        if (!(weight > 0)) return 0.0f;
        const double value = weight / pixels_[i].threshold;
        return value < kLargestWeight ? static_cast<float>(value) : kLargestWeight;
      };
      weights = max_of(weights, Vec3{relative(w.x), relative(w.y), relative(w.z)});
    });
    walk_.weights = weights;
    return packets;
  }

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
      const std::uint32_t kept = i < old.shares.size() ? i : kNone;
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
        const std::uint32_t kept = i < old.shares.size() ? i : kNone;
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
    return size >= context_.max_cut;
  }

  // --- Nodes of the cut ---

  /// An inner node stays in the cut.
  void keep(LightKind kind, const CutLight& light, std::uint32_t kept) {
    CutEntries& entries = scratch_.entries[index(kind)];
    entries.lights.push_back(light);
    if (context_.visibility != nullptr) entries.shares.push_back(share_of(kind, light.light, kept));
  }

  void choose(LightKind kind, const ChosenNode& chosen) {
    if (chosen.bound < 0) {
      tell_hidden(kind, chosen.node);
      return;
    }
    const CutLight light = cut_light(kind, tree(kind), context_.lights, chosen.node, chosen.bound);
    if (!tree(kind).nodes[chosen.node].is_leaf()) {
      keep(kind, light, chosen.kept);
      return;
    }
    CutEntries& leaves = scratch_.leaves;
    leaves.lights.push_back(light);
    if (context_.visibility != nullptr) leaves.shares.push_back(share_of(kind, light.light, chosen.kept));
    if (leaves.lights.size() == kBlock) add_leaves(kind);
  }

  void tell_hidden(LightKind kind, std::uint32_t node) {
    std::uint8_t pixels[kTilePixels];
    std::size_t count = 0;
    for_each_pending([&](int i) { pixels[count++] = group_.pixels[i]; });
    tools_.listener->hidden(kind, node, walk_.group, {pixels, count});
  }

  /// How much of a representative arrives, from the last round or by asking.
  PacketShare share_of(LightKind kind, std::uint32_t light, std::uint32_t kept) {
    if (kept != kNone) return scratch_.old[index(kind)].shares[kept];
    PacketFactors factors;
    RayPacket16 rays;
    PacketShare share{};
    const std::uint32_t candidates = shadow_rays(kind, light, factors, rays) & pending_[0];
    if (candidates != 0) {
      out_.rays += context_.visibility->shares({kind, light, receivers_[0], rays, candidates}, share.of);
    }
    return share;
  }

  std::uint32_t shadow_rays(LightKind kind, std::uint32_t light, PacketFactors& factors, RayPacket16& rays) const {
    const LightSet& lights = context_.lights;
    switch (kind) {
      case LightKind::vpl:
        return tools_.shade.vpl_shadow_rays(receivers_[0], lights.vpls[light], context_.min_distance_sq, factors, rays);
      case LightKind::point:
        return tools_.shade.point_shadow_rays(receivers_[0], lights.points[light], factors, rays);
      case LightKind::directional:
        return tools_.shade.directional_shadow_rays(receivers_[0], lights.directionals[light], factors, rays);
    }
    return 0;
  }

  // --- Light ---

  /// Adds nodes to light, lost and largest of the pixels of a packet.
  void sum(LightKind kind, int packet, const CutLight* lights, const PacketShare* shares, std::size_t count) {
    for (std::size_t first = 0; first < count; first += kBlock) {
      const CutTask task{receivers_[packet], weights_[packet], lights + first,
                         shares == nullptr ? nullptr : shares + first, std::min(kBlock, count - first)};
      CutSum sum;
      switch (kind) {
        case LightKind::vpl:
          tools_.cut.sum_vpls(task, context_.min_distance_sq, sum);
          break;
        case LightKind::point:
          tools_.cut.sum_points(task, context_.lights.points.data(), sum);
          break;
        case LightKind::directional:
          tools_.cut.sum_directionals(task, context_.lights.directionals.data(), sum);
          break;
      }
      for (int lane = 0; lane < kPacketSize; ++lane) {
        PixelState& pixel = pixels_[packet * kPacketSize + lane];
        pixel.light += Vec3T<double>{sum.sum.light.x[lane], sum.sum.light.y[lane], sum.sum.light.z[lane]};
        pixel.lost += sum.sum.lost[lane];
        pixel.largest = std::max(pixel.largest, sum.largest[lane]);
      }
      out_.pairs += task.count * static_cast<std::uint64_t>(std::popcount(pending_[packet]));
    }
  }

  void sum_entries(int packet) {
    for (int i = packet * kPacketSize; i < (packet + 1) * kPacketSize; ++i) {
      pixels_[i].light = pixels_[i].fixed;
      pixels_[i].lost = pixels_[i].fixed_lost;
      pixels_[i].largest = 0;
    }
    for (const LightKind kind : kLightKinds) {
      const CutEntries& entries = scratch_.entries[index(kind)];
      sum(kind, packet, entries.lights.data(), context_.visibility == nullptr ? nullptr : entries.shares.data(),
          entries.lights.size());
    }
  }

  /// Leaves never leave the cut again: they go into the pixels' fixed sums and are forgotten.
  void add_leaves(LightKind kind) {
    CutEntries& leaves = scratch_.leaves;
    if (leaves.lights.empty()) return;
    for (int p = 0; p < packet_count_; ++p) {
      if (pending_[p] == 0) continue;
      for (int i = p * kPacketSize; i < (p + 1) * kPacketSize; ++i) {
        pixels_[i].light = {0, 0, 0};
        pixels_[i].lost = 0;
      }
      sum(kind, p, leaves.lights.data(), context_.visibility == nullptr ? nullptr : leaves.shares.data(),
          leaves.lights.size());
      for (int i = p * kPacketSize; i < (p + 1) * kPacketSize; ++i) {
        pixels_[i].fixed += pixels_[i].light;
        pixels_[i].fixed_lost += pixels_[i].lost;
      }
    }
    std::uint8_t pixels[kTilePixels];
    std::size_t count = 0;
    for_each_pending([&](int i) { pixels[count++] = group_.pixels[i]; });
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
    for_each_pending([&](int i) {
      if ((packets >> (i / kPacketSize) & 1u) == 0) return;
      PixelState& pixel = pixels_[i];
      pixel.total = reflected(i, pixel.light);
      if (!all && pixel.largest > context_.threshold(pixel.total)) {
        const double wanted = kNextCaution * context_.threshold(pixel.total);
        const double lowest = std::min<double>(pixel.threshold, pixel.largest) / kLargestDrop;
        pixel.threshold = pixel.rounds >= kMostRounds ? 0 : std::max(wanted, lowest);
        return;
      }
      const std::uint8_t at = group_.pixels[i];
      out_.light[at] = pixel.light;
      out_.lost[at] = pixel.lost;
      record_cut(out_, at, size, pixel.largest, pixel.total, context_);
      done[done_count++] = at;
      pending_[i / kPacketSize] &= ~(1u << (i % kPacketSize));
    });
    if (done_count == 0) return;
    for (const LightKind kind : kLightKinds) report(kind, scratch_.entries[index(kind)], {done, done_count});
  }

  const CutTools& tools_;
  const CutContext& context_;
  const PixelGroup& group_;
  CutScratch& scratch_;
  TileLight& out_;
  double extent_sq_;
  int packet_count_;
  ReceiverPacket receivers_[kTilePackets];
  PacketVec3 weights_[kTilePackets];
  std::uint32_t pending_[kTilePackets] = {};
  PixelState pixels_[kTilePixels];
  std::uint64_t leaf_count_ = 0;
  GroupWalk walk_;
};

/// Diagonal of the box around lights and receivers [m].
double extent_of(const LightTrees& trees, std::span<const SurfacePacket> packets) {
  Box box;
  if (!trees.vpls.nodes.empty()) box = extend(box, trees.vpls.nodes[0].box);
  if (!trees.points.nodes.empty()) box = extend(box, trees.points.nodes[0].box);
  for (const SurfacePacket& packet : packets) {
    for (std::uint32_t lanes = packet.receivers.active; lanes != 0; lanes &= lanes - 1)
      box = extend(box, lane_of(packet.receivers.position, std::countr_zero(lanes)));
  }
  return std::max(static_cast<double>(diagonal(box)), 1e-9);
}

}  // namespace

Frontier make_frontier(const LightTrees& trees, const LightSet& lights, std::uint32_t size) {
  Frontier frontier;
  for (const LightKind kind : kLightKinds) {
    const LightTree& tree = tree_of(trees, kind);
    if (tree.nodes.empty()) continue;
    const auto dimmer = [&](std::uint32_t a, std::uint32_t b) {
      const auto power = [&](std::uint32_t n) {
        return tree.nodes[n].is_leaf() ? -1.0f : luminance(tree.nodes[n].intensity);
      };
      return power(a) < power(b);
    };
    std::vector<std::uint32_t> heap{0};
    while (heap.size() < size && !tree.nodes[heap.front()].is_leaf()) {
      std::pop_heap(heap.begin(), heap.end(), dimmer);
      const LightNode& brightest = tree.nodes[heap.back()];
      heap.back() = brightest.first_child;
      std::push_heap(heap.begin(), heap.end(), dimmer);
      heap.push_back(brightest.second_child());
      std::push_heap(heap.begin(), heap.end(), dimmer);
    }
    for (const std::uint32_t node : heap) {
      const CutLight light = cut_light(kind, tree, lights, node, 0);
      if (is_finite(light.intensity)) frontier.lights[index(kind)].push_back(light);
    }
  }
  return frontier;
}

void cut_pixels(const CutTools& tools, std::span<const SurfacePacket> packets, CutScratch& scratch, TileLight& out) {
  const double extent = extent_of(tools.context.trees, packets);
  const GroupLimits limits{static_cast<float>(tools.tuning.extent * extent), tools.tuning.cosine, tools.tuning.pixels};
  for (const PixelGroup& group : group_pixels(packets, limits)) {
    GroupCut(tools, packets, group, extent * extent, scratch, out).run();
  }
}

}  // namespace lightcuts
