#pragma once

#include "cuda/hidden_nodes.cuh"
#include "cuda/packet_cut.h"
#include "cuda/see.cuh"
#include "cuda/warp.cuh"
#include "kernels/cluster_bound.h"
#include "kernels/group_bound.h"

namespace lightcuts::cuda {

// --- Bounds ---

template <int kind>
__device__ inline float group_bound(const ReceiverGroup<FastFloat>& group, const LightNode& node,
                                    float min_distance_sq) {
  const ClusterBounds<FastFloat> lights{fast(node.box.lo), fast(node.box.hi), fast(node.axis),
                                        FastFloat(node.cos_half_angle)};
  if constexpr (kind == vpl_kind) return group_vpl_bound(group, lights, FastFloat(min_distance_sq)).value;
  if constexpr (kind == point_kind) return group_point_bound(group, lights, FastFloat(kPointGuardSq)).value;
  return group_directional_bound(group, lights).value;
}

// --- The walk of a warp ---

inline constexpr int kStack = 320;   ///< nodes to go below
inline constexpr int kChosen = 256;  ///< nodes that are summed together, in single precision

/// A node and the pixels that it concerns.
struct PixelsNode {
  std::uint32_t index;
  unsigned lanes;
};

/// A warp's shared memory.
template <class Visibility>
struct WarpSpace {
  StagedLight lights[32];
  typename Visibility::Staged seen[32];  ///< of `lights`
  PixelsNode stack[kStack];              ///< first children of the nodes to go below
  PixelsNode chosen[kChosen];
  Umbras<Visibility::shadows> umbras;
};

/// What a warp of a team found for a pixel; it lies in the warp's `lights`.
struct TeamPart {
  Vec3T<double> light;
  double lost;
  std::uint32_t found, rays;
  float largest, own_largest;
};
static_assert(sizeof(TeamPart) <= sizeof(StagedLight));

/// A threshold of the first walk relative to the estimate, and of the next ones, once a cut's total is known.
inline constexpr float kFirstCaution = 0.9f, kNextCaution = 0.98f;
/// A threshold sinks at most by this factor from one walk to the next.
inline constexpr float kLargestDrop = 16;
/// Walks after which a threshold is 0: every light counts by itself, which keeps any promise.
inline constexpr int kMostRounds = 16;
/// Groups of a tile; what is left over is a group by itself, however scattered.
inline constexpr int kMostGroups = 4;

/// What became of a tile: lit; left as too much for one warp; left because lights could not be looked at (maps missing).
enum class TileOutcome : std::uint8_t { lit, heavy, missed };

/// A warp lights a tile's 32 pixels; or a team of warps, one block, of which each walks its own parts of the trees and all
/// come to the same sums and decisions.
///
/// Where Visibility::own_cuts, a node that the group as a whole refuses is tested for each pixel too: every pixel has a
/// cut of its own then.
template <class Visibility, bool listing = false, bool teamed = false>
class TileCut {
  static constexpr bool kOwnCuts = Visibility::own_cuts;
  using Space = WarpSpace<Visibility>;

 public:
  __device__ TileCut(const CutJob& job, const Visibility& visibility, const CutView& cuts, Space* spaces)
      : job_(job),
        visibility_(visibility),
        cuts_(cuts),
        spaces_(spaces),
        space_(spaces[threadIdx.x / 32]),
        warp_(static_cast<int>(threadIdx.x / 32)),
        lane_(static_cast<int>(threadIdx.x % 32)) {}

  /// Nothing is written of a tile that is left.
  __device__ TileOutcome run(const PixelView& pixels, const SumView& sums, std::uint32_t slot) {
    const Vec3 position = pixels.position[slot], ns = pixels.ns[slot], ng = pixels.ng[slot];
    const Vec3 albedo = pixels.albedo[slot];
    const bool lit = !(ns == Vec3{});
    tile_ = slot / kTilePixels;
    receiver_ = {fast(position), fast(ns), fast(ng)};
    position_ = position;
    weights_ = lit ? Vec3{0.2126f * albedo.x, 0.7152f * albedo.y, 0.0722f * albedo.z} : Vec3{};
    unsigned waiting = __ballot_sync(kAllLanes, lit);
    mine_ = lit;
    float total = waiting != 0 ? estimate() : 0;
    if (teamed && warp_ > 0) rays_ = pairs_ = 0;  // every warp made the same estimate
    for (int number = 1; waiting != 0; ++number) {
      const unsigned group = number < kMostGroups ? like_first(waiting, position, ns) : waiting;
      waiting &= ~group;
      light_group(group, total);
      ++groups_;
      if (too_heavy()) return TileOutcome::heavy;
    }
    if (missed_) return TileOutcome::missed;
    if (cuts_.counts != nullptr) add_counts();
    if (teamed && warp_ > 0) return TileOutcome::lit;
    if (lit) {
      sums.light[slot] += light_;
      sums.lost[slot] += lost_;
      sums.rays[slot] += rays_;
    }
    cuts_.size[slot] = lit ? size_ : 0;
    cuts_.bound[slot] = bound_;
    cuts_.at_limit[slot] = at_limit_ ? 1 : 0;
    return TileOutcome::lit;
  }

 private:
  // --- What the pixels get ---

  __device__ bool too_heavy() const { return !teamed && cuts_.heavy != nullptr && visits_ > job_.heavy_visits; }

  /// Adds a light of the list, as far as it arrives.
  /// @param wanted  the pixel has this light in its cut
  template <int kind>
  __device__ void add_seen(const StagedLight& light, const typename Visibility::Staged& seen, bool wanted) {
    const LightFactor f = factor_of<kind>(receiver_, light, job_.min_distance * job_.min_distance);
    float share = 1;
    if constexpr (Visibility::shadows) {
      share = 0;
      if (wanted && f.unclamped > 0) {
        share = visibility_.template share<kind>(receiver_, position_, light, seen);
        if (Visibility::traces) ++rays_;
      }
    }
    add<kind>(light, f, share);
  }

  template <int kind>
  __device__ void add(const StagedLight& light, LightFactor f, float share) {
    const float arrives = f.clamped * share;
    block_ += Vec3{light.red, light.green, light.blue} * arrives;
    if constexpr (kind == vpl_kind) {
      const float lost = f.unclamped - f.clamped;
      if (lost > 0) block_lost_ += luminance(Vec3{light.red, light.green, light.blue}) * lost * share;
    }
  }

  __device__ void close_block(bool keep) {
    if (keep) {
      light_ += Vec3T<double>{block_.x, block_.y, block_.z};
      lost_ += block_lost_;
    }
    block_ = {};
    block_lost_ = 0;
  }

  /// Luminance of what a pixel reflects, times pi.
  __device__ float total_of(Vec3T<double> light) const {
    const double total = weights_.x * light.x + weights_.y * light.y + weights_.z * light.z;
    return static_cast<float>(total > 0 ? fmin(total, 3e38) : 0);
  }

  // --- The estimate ---

  template <int kind>
  __device__ void add_frontier() {
    const TreeView& tree = job_.trees.kind[kind];
    for (std::uint32_t i = 0; i < tree.frontier_count; ++i) {
      const StagedLight light = tree.frontier[i];
      add<kind>(light, factor_of<kind>(receiver_, light, job_.min_distance * job_.min_distance), 1);
    }
    pairs_ += tree.frontier_count;
  }

  /// A quarter of the upper level, each light from a quarter of the pixels: seen with and without shadows.
  template <int kind>
  __device__ void sample_frontier(float& offered, float& arrived) {
    const TreeView& tree = job_.trees.kind[kind];
    const std::uint32_t step = tree.frontier_count >= 32 ? 4 : 1;
    for (std::uint32_t i = 0; i < tree.frontier_count; i += step) {
      const std::uint32_t own = min_of(i + static_cast<std::uint32_t>(lane_) % step, tree.frontier_count - 1);
      const StagedLight light = tree.frontier[own];
      const LightFactor f = factor_of<kind>(receiver_, light, job_.min_distance * job_.min_distance);
      if (!mine_ || !(f.unclamped > 0)) continue;
      const float power = dot(weights_, Vec3{light.red, light.green, light.blue}) * f.clamped;
      offered += power;
      typename Visibility::Staged seen;
      visibility_.template stage<kind>(light.light, seen);
      arrived += power * visibility_.template share<kind>(receiver_, position_, light, seen);
      if (Visibility::traces) ++rays_;
    }
  }

  /// The pixel's total by the nodes of the trees' upper levels.
  __device__ float estimate() {
    add_frontier<vpl_kind>();
    add_frontier<point_kind>();
    add_frontier<directional_kind>();
    const float total = total_of({block_.x, block_.y, block_.z});
    close_block(false);
    if constexpr (Visibility::shadows) {
      float offered = 0, arrived = 0;
      sample_frontier<vpl_kind>(offered, arrived);
      sample_frontier<point_kind>(offered, arrived);
      sample_frontier<directional_kind>(offered, arrived);
      offered = warp_sum(offered);
      arrived = warp_sum(arrived);
      return offered > 0 ? total * fmaxf(arrived / offered, 1.0f / 64) : total;
    }
    return total;
  }

  // --- Groups ---

  /// Of the waiting pixels, those on the same surface as the first.
  __device__ unsigned like_first(unsigned waiting, Vec3 position, Vec3 ns) const {
    const int leader = __ffs(static_cast<int>(waiting)) - 1;
    const Vec3 normal = from_lane(ns, leader), way = position - from_lane(position, leader);
    const float off = fabsf(dot(normal, way));
    const bool alike = dot(normal, ns) > 0.9f && off * off <= 0.1f * dot(way, way) + 1e-12f;
    return __ballot_sync(kAllLanes, alike) & waiting;
  }

  __device__ void gather_group(unsigned lanes) {
    const bool in = (lanes >> lane_ & 1u) != 0;
    const Vec3 position = position_, normal{receiver_.ns.x.value, receiver_.ns.y.value, receiver_.ns.z.value};
    const Vec3 far{kInfinity, kInfinity, kInfinity};
    const Box box{warp_min(in ? position : far), warp_max(in ? position : -far)};
    const Vec3 any = from_lane(normal, __ffs(static_cast<int>(lanes)) - 1);
    const bool all_same = __all_sync(kAllLanes, !in || normal == any) != 0;
    const Vec3 axis = group_axis(warp_sum(in ? normal : Vec3{}), any, all_same);
    const float cosine = warp_min(in ? group_cosine(axis, normal) : 1.0f);
    const float gain_lo = warp_min(in ? gap_to_end(-axis, box, position) : kInfinity);
    const float gain_hi = warp_min(in ? gap_to_end(axis, box, position) : kInfinity);
    group_ = receiver_group<FastFloat>(box, axis, cosine, gain_lo, gain_hi);
    space_.umbras.find(job_, box, lane_);
  }

  // --- Rounds ---

  __device__ void light_group(unsigned lanes, float estimate) {
    const bool member = (lanes >> lane_ & 1u) != 0;
    gather_group(lanes);
    const float largest = warp_max(member ? estimate : 0.0f);
    const float error = static_cast<float>(job_.error * (1 - kThresholdSlack));
    // Where the upper level shows nothing, the search for the total starts from what there could be at most.
    float total = largest > 0 ? fmaxf(estimate, largest / 64) : root_bound(member) / 64;
    float threshold = kFirstCaution * error * total;
    for (int round = 1; lanes != 0; ++round) {
      mine_ = (lanes >> lane_ & 1u) != 0;
      lanes_ = lanes;
      if (round > 1) gather_group(lanes);
      scale_ = demands(threshold);
      threshold_ = threshold;
      const bool limited = job_.max_cut > 0 && fit();
      if (mine_) {
        light_ = {};
        lost_ = 0;
      }
      walk_all<false>(0);
      if (too_heavy() || missed_) return;  // a total that lacks shadows says nothing
      const float seen = total_of(light_);
      // The bounds are in units of the smallest threshold, taken with the largest weight of each colour.
      const float bound = fmaxf(largest_bound_ * fit_scale_ * threshold, own_largest_);
      const bool kept = bound <= error * seen;
      if (mine_) {
        size_ = found_;
        bound_ = !(bound > 0) ? 0.0f : bound < 3e38f * seen ? bound / seen : 3e38f;
        at_limit_ = !kept;
      }
      lanes = limited ? 0 : __ballot_sync(kAllLanes, mine_ && !kept);
      threshold = round >= kMostRounds ? 0 : fmaxf(kNextCaution * error * seen, threshold / kLargestDrop);
      ++walks_;
    }
  }

  /// By what a node's intensity is multiplied so that 1 is what every pixel of the group accepts.
  __device__ Vec3 demands(float threshold) {
    fit_scale_ = 1;
    const auto demand = [&](float weight) {
      const float own = !mine_ || !(weight > 0) ? 0.0f : threshold > 0 ? weight / threshold : kInfinity;
      return warp_max(own);
    };
    return {demand(weights_.x), demand(weights_.y), demand(weights_.z)};
  }

  /// Bound on a pixel's total by the trees' roots.
  __device__ float root_bound(bool member) {
    const float largest_x = warp_max(member ? weights_.x : 0.0f), largest_y = warp_max(member ? weights_.y : 0.0f),
                largest_z = warp_max(member ? weights_.z : 0.0f);
    const Vec3 weights{largest_x, largest_y, largest_z};
    float sum = 0;
    if (job_.trees.kind[0].leaf_count > 0) sum += node_bound<0>(weights, job_.trees.kind[0].nodes[0]);
    if (job_.trees.kind[1].leaf_count > 0) sum += node_bound<1>(weights, job_.trees.kind[1].nodes[0]);
    if (job_.trees.kind[2].leaf_count > 0) sum += node_bound<2>(weights, job_.trees.kind[2].nodes[0]);
    return fminf(sum, 3e38f);
  }

  template <int kind>
  __device__ float node_bound(Vec3 scale, const LightNode& node) const {
    const float geometric = group_bound<kind>(group_, node, job_.min_distance * job_.min_distance);
    return geometric > 0 ? dot(scale, node.intensity) * geometric : geometric;
  }

  // --- A largest cut ---

  /// Raises the threshold until the cut is not larger than allowed; returns whether it had to.
  __device__ bool fit() {
    if (fits(1)) return false;
    float below = 1, above = 16;
    while (!fits(above) && above < 1e30f) {
      below = above;
      above *= 16;
    }
    for (int step = 0; step < 10; ++step) {
      const float middle = sqrtf(below * above);
      (fits(middle) ? above : below) = middle;
    }
    fit_scale_ = above;
    return true;
  }

  __device__ bool fits(float scale) {
    fit_scale_ = scale;
    walk_all<true>(job_.max_cut);
    return !__any_sync(kAllLanes, mine_ && found_ > job_.max_cut);
  }

  // --- The walk ---

  /// Sends the group through all trees. Leaves found_, the largest bounds and, unless it only counts, the pixels' light.
  template <bool counting>
  __device__ void walk_all(std::uint32_t limit) {
    found_ = 0;
    largest_bound_ = own_largest_ = 0;
    walk_tree<vpl_kind, counting>(limit);
    walk_tree<point_kind, counting>(limit);
    walk_tree<directional_kind, counting>(limit);
    largest_bound_ = warp_max(largest_bound_);
    if constexpr (teamed) join_team();
  }

  /// A single warp starts at the root, each of a team with its own of the parts that the tree was taken apart into.
  template <int kind, bool counting>
  __device__ void walk_tree(std::uint32_t limit) {
    const TreeView& tree = job_.trees.kind[kind];
    if (tree.leaf_count == 0) return;
    if constexpr (!teamed) {
      walk<kind, counting>(limit, lane_ == 0 ? 0 : kNone);
    } else {
      const int team = team_size();
      for (int first = 0; first < static_cast<int>(kTreeParts); first += team * 32)
        walk<kind, counting>(limit, tree.parts[first + lane_ * team + warp_]);
    }
  }

  /// Warps of the team, a power of two.
  __device__ static int team_size() { return static_cast<int>(blockDim.x / 32); }

  /// Adds up what the warps of a team found, in their order: all of them get the same.
  __device__ void join_team() {
    __syncwarp();
    auto* const own = reinterpret_cast<TeamPart*>(space_.lights);
    own[lane_] = {light_, lost_, found_, rays_, largest_bound_, own_largest_};
    missed_ = __syncthreads_or(missed_ ? 1 : 0) != 0;
    Vec3T<double> light{};
    double lost = 0;
    std::uint32_t rays = 0;
    found_ = 0;
    for (int w = 0; w < team_size(); ++w) {
      const TeamPart part = reinterpret_cast<const TeamPart*>(spaces_[w].lights)[lane_];
      light += part.light;
      lost += part.lost;
      found_ += part.found;
      rays += part.rays;
      largest_bound_ = fmaxf(largest_bound_, part.largest);
      own_largest_ = fmaxf(own_largest_, part.own_largest);
    }
    rays_ = warp_ == 0 ? rays : 0;
    if (mine_) {  // the others' light is final
      light_ = light;
      lost_ = lost;
    }
    __syncthreads();
  }

  template <int kind, bool counting>
  __device__ void walk(std::uint32_t limit, std::uint32_t index) {
    const LightNode* const nodes = job_.trees.kind[kind].nodes;
    const Vec3 scale = scale_ * (1 / fit_scale_);
    const unsigned before = (1u << lane_) - 1;
    int waiting = 0, chosen = 0;
    // The first step tests the nodes given; each later one the children of up to 16 nodes, those found last.
    unsigned lanes = lanes_;
    while (true) {
      visits_ += static_cast<std::uint32_t>(__popc(__ballot_sync(kAllLanes, index != kNone)));
      bool accepts = false, splits = false, shines = false;
      std::uint32_t below = kNone;
      if (index != kNone) {
        const LightNode node = nodes[index];
        below = node.first_child;
        const float bound = node_bound<kind>(scale, node);
        shines = !(bound == 0);
        accepts = node.is_leaf() || bound <= 1;
        splits = !accepts;
        if (shines && space_.umbras.template hide<kind>(node.box)) accepts = splits = shines = false;
        if (accepts && !node.is_leaf()) largest_bound_ = fmaxf(largest_bound_, bound);
      }
      const unsigned accepting = __ballot_sync(kAllLanes, accepts);
      count_found(accepting, lanes);
      unsigned taking = accepts ? lanes : 0;  // pixels that take this lane's node into their cut
      if constexpr (kOwnCuts) {
        const unsigned taken = take_one_by_one<kind>(nodes, index, lanes, __ballot_sync(kAllLanes, splits));
        taking |= taken;
        lanes &= ~taken;
        splits = splits && lanes != 0;
      }
      if constexpr (listing && !counting) {
        if (taking != 0) list(kind, index, taking);
      }
      if (counting && __any_sync(kAllLanes, mine_ && found_ > limit)) return;
      if constexpr (!counting) {
        // What cannot shine at any pixel of the group is in the cut, but needs no look.
        const bool look = taking != 0 && shines;
        const unsigned looking = __ballot_sync(kAllLanes, look);
        if (look) space_.chosen[chosen + __popc(looking & before)] = {index, taking};
        chosen += __popc(looking);
      }
      const unsigned splitting = __ballot_sync(kAllLanes, splits);
      if (splits) space_.stack[waiting + __popc(splitting & before)] = {below, lanes};
      waiting += __popc(splitting);
      __syncwarp();
      if (!counting && chosen > kChosen - 32) {
        sum_chosen<kind>(chosen);
        chosen = 0;
      }
      if (waiting == 0 || too_heavy()) break;
      // With little room left, one node at a time and the smaller child first: what waits then doubles with each entry.
      const bool full = waiting > kStack - 96;
      const int taken = full ? 1 : min_of(waiting, 16);
      waiting -= taken;
      index = kNone;
      if (lane_ < 2 * taken) {
        const PixelsNode top = space_.stack[waiting + lane_ / 2];
        index = top.index + static_cast<std::uint32_t>(lane_ % 2);
        lanes = top.lanes;
      }
      if (full) index = smaller_last(nodes, index);
      __syncwarp();
    }
    if (!counting && chosen > 0) sum_chosen<kind>(chosen);
    __syncwarp();
  }

  /// Counts the nodes that the group accepted, for each pixel they concern.
  __device__ void count_found(unsigned accepting, unsigned lanes) {
    if constexpr (!kOwnCuts) {
      found_ += static_cast<std::uint32_t>(__popc(accepting));
    } else {
      for (; accepting != 0; accepting &= accepting - 1)
        found_ += __shfl_sync(kAllLanes, lanes, __ffs(static_cast<int>(accepting)) - 1) >> lane_ & 1u;
    }
  }

  /// Tests the nodes that the group refused for each pixel; returns the pixels that take this lane's node.
  template <int kind>
  __device__ unsigned take_one_by_one(const LightNode* nodes, std::uint32_t index, unsigned lanes, unsigned refused) {
    unsigned taken = 0;
    for (; refused != 0; refused &= refused - 1) {
      const int from = __ffs(static_cast<int>(refused)) - 1;
      const std::uint32_t node_index = __shfl_sync(kAllLanes, index, from);
      const unsigned concerned = __shfl_sync(kAllLanes, lanes, from);
      const float bound = own_bound<kind>(nodes[node_index]);
      const bool accepts = (concerned >> lane_ & 1u) != 0 && bound <= threshold_ * fit_scale_;
      if (accepts) {
        ++found_;
        own_largest_ = fmaxf(own_largest_, bound);
      }
      const unsigned accepting = __ballot_sync(kAllLanes, accepts);
      if (lane_ == from) taken = accepting;
    }
    return taken;
  }

  /// Bound on what this pixel reflects of a node's light.
  template <int kind>
  __device__ float own_bound(const LightNode& node) const {
    const LitPoint<FastFloat> point{receiver_.position, receiver_.ns};
    const DirectionCone cone{node.axis, node.cos_half_angle};
    float geometric;
    if constexpr (kind == vpl_kind) {
      geometric = vpl_bound(point, node.box, cone, FastFloat(job_.min_distance * job_.min_distance)).value;
    } else if constexpr (kind == point_kind) {
      geometric = point_bound(point, node.box, cone, FastFloat(kPointGuardSq)).value;
    } else {
      geometric = directional_bound(receiver_.ns, node.box).value;
    }
    return geometric > 0 ? dot(weights_, node.intensity) * geometric : geometric;
  }

  /// Of two siblings in lanes 0 and 1, the one with more leaves in lane 0: the stack gets it first.
  __device__ std::uint32_t smaller_last(const LightNode* nodes, std::uint32_t index) const {
    const std::uint32_t leaves = index == kNone ? 0 : nodes[index].leaf_count;
    const bool swap = __shfl_sync(kAllLanes, leaves, 0) < __shfl_sync(kAllLanes, leaves, 1);
    const std::uint32_t other = __shfl_xor_sync(kAllLanes, index, 1);
    return swap ? other : index;
  }

  /// Adds the chosen nodes' light to each pixel of the group.
  template <int kind>
  __device__ void sum_chosen(int count) {
    for (int first = 0; first < count; first += 32) {
      const int here = min_of(32, count - first);
      __syncwarp();
      if (lane_ < here) {
        const LightNode& node = job_.trees.kind[kind].nodes[space_.chosen[first + lane_].index];
        const std::uint32_t light = node.representative;
        space_.lights[lane_] = stage_light<kind>(job_.lights, light, node.intensity);
        if (cuts_.used[kind] != nullptr) mark(cuts_.used[kind], light);
        if (!visibility_.template stage<kind>(light, space_.seen[lane_])) missed_ = true;
        visibility_.template prefetch<kind>(space_.seen[lane_], position_);
      }
      if constexpr (Visibility::shadows) missed_ = __any_sync(kAllLanes, missed_) != 0;
      __syncwarp();
      for (int i = 0; i < here; ++i) {
        const bool wanted = !kOwnCuts || (space_.chosen[first + i].lanes >> lane_ & 1u) != 0;
        add_seen<kind>(space_.lights[i], space_.seen[i], wanted);
        if (wanted && mine_) ++pairs_;
      }
    }
    close_block(mine_);
  }

  __device__ void list(int kind, std::uint32_t node, unsigned lanes) const {
    const std::uint32_t place = atomicAdd(cuts_.listing.count, 1u);
    if (place >= cuts_.listing.capacity) return;
    cuts_.listing.nodes[place] = {tile_, walks_ + (teamed ? 1000u : 0u), lanes, static_cast<std::uint32_t>(kind), node};
  }

  __device__ static void mark(std::uint32_t* bits, std::uint32_t light) {
    const std::uint32_t bit = 1u << light % 32;
    if ((bits[light / 32] & bit) == 0) atomicOr(&bits[light / 32], bit);
  }

  __device__ void add_counts() {
    atomicAdd(&cuts_.counts->pairs, static_cast<unsigned long long>(pairs_));
    if (lane_ != 0) return;
    atomicAdd(&cuts_.counts->visits, static_cast<unsigned long long>(visits_));
    atomicAdd(&cuts_.counts->walks, static_cast<unsigned long long>(walks_));
    atomicAdd(&cuts_.counts->groups, static_cast<unsigned long long>(groups_));
  }

  const CutJob& job_;
  const Visibility& visibility_;
  const CutView& cuts_;
  Space* spaces_;
  Space& space_;
  int warp_, lane_;

  // This lane's pixel.
  Receiver<FastFloat> receiver_;
  Vec3 position_, weights_;
  bool mine_ = false;  ///< belongs to the group that is lit now
  Vec3T<double> light_{};
  double lost_ = 0;
  Vec3 block_{};
  float block_lost_ = 0;
  std::uint32_t size_ = 0, rays_ = 0;
  float bound_ = 0;
  bool at_limit_ = false;

  // The group's.
  ReceiverGroup<FastFloat> group_;
  Vec3 scale_;
  float fit_scale_ = 1;      ///< by which thresholds are raised for a largest cut
  float largest_bound_ = 0;  ///< that the group accepted, relative to the raised threshold
  float own_largest_ = 0;    ///< that the pixel accepted where the group did not
  float threshold_ = 0;      ///< the pixel's
  std::uint32_t found_ = 0;
  unsigned lanes_ = 0;
  bool missed_ = false;  ///< some light could not be looked at

  std::uint32_t tile_ = 0;
  std::uint32_t pairs_ = 0, visits_ = 0, walks_ = 0, groups_ = 0;
};

}  // namespace lightcuts::cuda
