#pragma once

#include "cuda/tile_light.cuh"
#include "kernels/cluster_bound.h"
#include "kernels/fit_search.h"
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

/// A threshold relative to the total that an earlier walk saw.
inline constexpr float kNextCaution = 0.98f;
/// A threshold sinks at most by this factor from one walk to the next.
inline constexpr float kLargestDrop = 16;
/// Walks after which a threshold is 0: every light counts by itself, which keeps any promise.
inline constexpr int kMostRounds = 16;
/// Groups of a tile; what is left over is a group by itself, however scattered.
inline constexpr int kMostGroups = 4;

/// What became of a tile: lit; left as too much for a warp; left because lights could not be looked at (maps missing).
enum class TileOutcome : std::uint8_t { lit, heavy, missed };

/// Lights a tile's 32 pixels, one a lane of each warp of the crew.
///
/// Where Visibility::own_cuts, a node that the group as a whole refuses is tested for each pixel too: every pixel has a
/// cut of its own then.
template <class Visibility, bool listing = false, Crew crew = Crew::warp>
class TileCut : TileLight<Visibility, crew> {
  using Base = TileLight<Visibility, crew>;
  using Base::job_, Base::cuts_, Base::space_, Base::warp_, Base::lane_, Base::remembered_, Base::meeting_;
  using Base::kOwnCuts, Base::kTeamed;
  using Base::light_, Base::lost_, Base::rays_, Base::pairs_, Base::heavy_, Base::missed_, Base::arrival_;
  using Base::receiver_, Base::position_, Base::weights_, Base::mine_, Base::ns, Base::ng, Base::total_of;
  using typename Base::Space;

 public:
  /// @param meeting  of the crew's blocks, if they are several
  __device__ TileCut(const CutJob& job, const Visibility& visibility, const CutView& cuts, Space& space,
                     const RememberedRays& remembered, Meeting* meeting = nullptr)
      : Base(job, visibility, cuts, space, remembered, meeting) {}

  /// Whether some light could not be looked at.
  [[nodiscard]] __device__ bool missed() const { return missed_; }

  /// Nothing is written of a tile that is left.
  /// @param missed  by the warp that left it: then it is walked only to find out which other maps will be missed
  __device__ TileOutcome run(const PixelView& pixels, const SumView& sums, std::uint32_t slot, bool missed) {
    missed_ = missed;
    this->open_pixel(pixels, slot);
    tile_ = slot / kTilePixels;
    const bool lit = mine_;
    unsigned waiting = __ballot_sync(kAllLanes, lit);
    for (int number = 1; waiting != 0; ++number) {
      const unsigned group = number < kMostGroups ? like_first(waiting) : waiting;
      waiting &= ~group;
      light_group(group);
      ++groups_;
      if (heavy_) return TileOutcome::heavy;
    }
    if (missed_) return TileOutcome::missed;
    if (cuts_.counts != nullptr) add_counts();
    if (kTeamed && warp_ > 0) return TileOutcome::lit;
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
  /// Of what this warp has done; the tile is then left to a crew.
  __device__ bool too_heavy() const {
    return !kTeamed && cuts_.left.tiles != nullptr && visits_ + Visibility::look_tests * looks_ > job_.heavy_work;
  }

  /// Waits for the others that share the space.
  __device__ static void meet() {
    if constexpr (kTeamed) {
      __syncthreads();
    } else {
      __syncwarp();
    }
  }

  // --- Groups ---

  /// Of the waiting pixels, those on the same surface as the first.
  __device__ unsigned like_first(unsigned waiting) const {
    const int leader = __ffs(static_cast<int>(waiting)) - 1;
    const Vec3 normal = from_lane(ns(), leader), way = position_ - from_lane(position_, leader);
    const float off = fabsf(dot(normal, way));
    const bool alike = dot(normal, ns()) > 0.9f && off * off <= 0.1f * dot(way, way) + 1e-12f;
    return __ballot_sync(kAllLanes, alike) & waiting;
  }

  __device__ void gather_group(unsigned lanes, bool first) {
    const bool in = (lanes >> lane_ & 1u) != 0;
    const Vec3 position = position_, normal = ns();
    const Vec3 far{kInfinity, kInfinity, kInfinity};
    const Box box{warp_min(in ? position : far), warp_max(in ? position : -far)};
    const Vec3 any = from_lane(normal, __ffs(static_cast<int>(lanes)) - 1);
    const bool all_same = __all_sync(kAllLanes, !in || normal == any) != 0;
    const Vec3 axis = group_axis(warp_sum(in ? normal : Vec3{}), any, all_same);
    const float cosine = warp_min(in ? group_cosine(axis, normal) : 1.0f);
    const float gain_lo = warp_min(in ? gap_to_end(-axis, box, position) : kInfinity);
    const float gain_hi = warp_min(in ? gap_to_end(axis, box, position) : kInfinity);
    group_ = receiver_group<FastFloat>(box, axis, cosine, gain_lo, gain_hi);
    if (first) {  // what is hidden from all of them is from those of later rounds too
      if constexpr (Visibility::traces) {
        remembered_.forget(kTeamed ? threadIdx.x : static_cast<std::uint32_t>(lane_), kTeamed ? kTeam * 32 : 32);
      }
      if (!kTeamed || threadIdx.x < 32) space_.umbras.find(job_, box, lane_);
      meet();
    }
    if constexpr (Visibility::shadows) {
      const auto of_all = Visibility::group(lanes, position, ng());
      meet();
      if (lane_ == 0 && (!kTeamed || threadIdx.x == 0)) space_.group = of_all;
      meet();
    }
  }

  // --- Rounds ---
  //
  // What is long is written, and compiled, in one place: a kernel whose loops do not fit into the instruction cache waits for
  // instructions.

  __device__ void light_group(unsigned lanes) {
    const float error = static_cast<float>(job_.error * (1 - kThresholdSlack));
    float threshold = 0;
    for (int round = 1; lanes != 0; ++round) {
      mine_ = (lanes >> lane_ & 1u) != 0;
      lanes_ = lanes;
      gather_group(lanes, round == 1);
      if (round == 1) threshold = error * first_total(lanes);
      scale_ = demands(threshold);
      threshold_ = threshold;
      const bool limited = walk_until_it_fits();
      if (heavy_) return;
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

  /// The total of this lane's pixel that the first walk takes for granted, with caution.
  __device__ float first_total(unsigned lanes) {
    const auto upper = this->estimate(lanes);
    const float most = total_of(upper.most), largest = warp_max_positive(mine_ ? most : 0.0f);
    // Where pixels have cuts of their own, none needs the least of all.
    const float least = kOwnCuts ? most : total_of(upper.least);
    // Where the upper level shows nothing, the search for the total starts from what there could be at most.
    const float total = largest > 0 ? fmaxf(least, largest / 64) : root_bound() / 64;
    // Where it shows hardly anything, it starts from all that was offered.
    return total * (arrival_ < kUnsureArrival ? 1 / arrival_ : Visibility::first_caution);
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
  __device__ float root_bound() {
    const Vec3 own = mine_ ? weights_ : Vec3{};
    const Vec3 weights{warp_max_positive(own.x), warp_max_positive(own.y), warp_max_positive(own.z)};
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

  // --- The walk ---

  /// Walks once, and where a cut must not be larger than allowed first until a threshold is found at which it is not; returns
  /// whether that is a higher one. Leaves found_, the largest bounds and the pixels' light.
  __device__ bool walk_until_it_fits() {
    FitSearch search;
    bool counting = job_.max_cut > 0;
    while (true) {
      fit_scale_ = search.scale;
      if (mine_ && !counting) {
        light_ = {};
        lost_ = 0;
      }
      walk_all(counting);
      if (heavy_ || !counting) return search.raised;
      counting = search.next(!__any_sync(kAllLanes, mine_ && found_ > job_.max_cut));
    }
  }

  /// Sends the group through all trees.
  /// @param counting  only to find out whether the cut is larger than allowed
  __device__ void walk_all(bool counting) {
    found_ = 0;
    largest_bound_ = own_largest_ = 0;
    walk_tree<vpl_kind>(counting);
    walk_tree<point_kind>(counting);
    walk_tree<directional_kind>(counting);
    largest_bound_ = warp_max(largest_bound_);
    heavy_ = too_heavy();
    if constexpr (kTeamed) join_crew();
  }

  /// A single warp starts at the root, the blocks of a crew with their share of the parts that the tree was taken apart into.
  template <int kind>
  __device__ void walk_tree(bool counting) {
    const TreeView& tree = job_.trees.kind[kind];
    if (tree.leaf_count == 0) return;
    if constexpr (!kTeamed) {
      walk<kind>(counting);
    } else {
      const int blocks = meeting_->blocks(), own = static_cast<int>(threadIdx.x) * blocks + warp_ / kTeam;
      const bool whole = job_.max_cut > 0;  // the parts alone may be more than a largest cut
      const int parts = whole ? 1 : static_cast<int>(kTreeParts);
      for (int first = 0; first < parts; first += kTeam * 32 * blocks) {
        const int part = first + own;
        walk_together<kind>(counting, part >= parts ? kNone : whole ? 0 : tree.parts[part]);
      }
    }
  }

  __device__ void join_crew() {
    const CrewPart sum = this->add_up({light_, lost_, found_, rays_, largest_bound_, own_largest_});
    found_ = sum.found;
    largest_bound_ = sum.largest;
    own_largest_ = sum.own_largest;
    rays_ = warp_ == 0 ? sum.rays : 0;
    if (mine_) {  // the others' light is final
      light_ = sum.light;
      lost_ = sum.lost;
    }
  }

  /// What became of this lane's node.
  struct Tested {
    std::uint32_t below = kNone;  ///< its children, if it is split
    unsigned lanes = 0;           ///< pixels that want them
    unsigned taking = 0;          ///< pixels that take it into their cut
    bool splits = false;
    bool looks = false;  ///< it may give light to pixels that take it
  };

  template <int kind>
  __device__ Tested test(bool counting, std::uint32_t index, unsigned lanes) {
    const LightNode* const nodes = job_.trees.kind[kind].nodes;
    Tested tested;
    bool accepts = false, shines = false;
    if (index != kNone) {
      const LightNode node = nodes[index];
      tested.below = node.first_child;
      const float bound = node_bound<kind>(scale_ * (1 / fit_scale_), node);
      shines = !(bound == 0);
      accepts = node.is_leaf() || bound <= 1;
      tested.splits = !accepts;
      if (shines && space_.umbras.template hide<kind>(node.box)) accepts = tested.splits = shines = false;
      if (accepts && !node.is_leaf()) largest_bound_ = fmaxf(largest_bound_, bound);
    }
    count_found(__ballot_sync(kAllLanes, accepts), lanes);
    tested.taking = accepts ? lanes : 0;
    tested.lanes = lanes;
    if constexpr (kOwnCuts) {
      const unsigned taken = take_one_by_one<kind>(nodes, index, lanes, __ballot_sync(kAllLanes, tested.splits));
      tested.taking |= taken;
      tested.lanes &= ~taken;
      tested.splits = tested.splits && tested.lanes != 0;
    }
    if constexpr (listing) {
      if (!counting && tested.taking != 0) list(kind, index, tested.taking);
    }
    // What cannot shine at any pixel of the group is in the cut, but needs no look.
    tested.looks = !counting && tested.taking != 0 && shines;
    return tested;
  }

  template <int kind>
  __device__ void walk(bool counting) {
    const unsigned before = (1u << lane_) - 1;
    int waiting = 0, chosen = 0;
    // The first step tests the root; each later one the children of up to 16 nodes, those found last.
    std::uint32_t index = lane_ == 0 ? 0 : kNone;
    unsigned lanes = lanes_;
    while (true) {
      visits_ += static_cast<std::uint32_t>(__popc(__ballot_sync(kAllLanes, index != kNone)));
      const Tested tested = test<kind>(counting, index, lanes);
      if (counting && __any_sync(kAllLanes, mine_ && found_ > job_.max_cut)) return;
      const unsigned looking = __ballot_sync(kAllLanes, tested.looks);
      if (tested.looks) space_.chosen[chosen + __popc(looking & before)] = {index, tested.taking};
      chosen += __popc(looking);
      const unsigned splitting = __ballot_sync(kAllLanes, tested.splits);
      if (tested.splits) space_.stack[waiting + __popc(splitting & before)] = {tested.below, tested.lanes};
      waiting += __popc(splitting);
      __syncwarp();
      const bool done = waiting == 0 || too_heavy();
      if (done || chosen > Space::kChosen - 32) {
        this->template sum_chosen<kind>(chosen, 0, 32);
        looks_ += static_cast<std::uint32_t>(chosen);
        chosen = 0;
      }
      if (done) break;
      index = take<kind>(waiting, lanes);
      __syncwarp();
    }
    __syncwarp();
  }

  /// All warps of a block share what waits and what was chosen, so all have as much to do; places are given in the order of
  /// threads, so that sums are always the same.
  template <int kind>
  __device__ void walk_together(bool counting, std::uint32_t index) {
    const unsigned before = (1u << lane_) - 1;
    const int warp = static_cast<int>(threadIdx.x / 32);
    int waiting = 0, chosen = 0;
    unsigned lanes = lanes_;
    visits_ += static_cast<std::uint32_t>(__syncthreads_count(index != kNone ? 1 : 0));
    for (int step = 0;; ++step) {
      const Tested tested = test<kind>(counting, index, lanes);
      const unsigned splitting = __ballot_sync(kAllLanes, tested.splits),
                     looking = __ballot_sync(kAllLanes, tested.looks);
      std::uint32_t* const found = space_.found[step % 2];
      if (lane_ == 0) found[warp] = static_cast<std::uint32_t>(__popc(splitting) | __popc(looking) << 16);
      if (__syncthreads_or(counting && mine_ && found_ > job_.max_cut ? 1 : 0) != 0) return;
      std::uint32_t upto = lane_ < kTeam ? found[lane_] : 0;
      for (int other = 1; other < kTeam; other *= 2) {
        const std::uint32_t sum = __shfl_up_sync(kAllLanes, upto, other);
        if (lane_ >= other) upto += sum;
      }
      const std::uint32_t all = __shfl_sync(kAllLanes, upto, kTeam - 1);
      const std::uint32_t others = __shfl_sync(kAllLanes, upto, warp) - found[warp];
      if (tested.splits) {
        space_.stack[waiting + static_cast<int>(others & 0xffffu) + __popc(splitting & before)] = {tested.below,
                                                                                                   tested.lanes};
      }
      if (tested.looks) {
        space_.chosen[chosen + static_cast<int>(others >> 16) + __popc(looking & before)] = {index, tested.taking};
      }
      waiting += static_cast<int>(all & 0xffffu);
      chosen += static_cast<int>(all >> 16);
      __syncthreads();
      const bool done = waiting == 0;
      if (done || chosen > Space::kChosen - 32 * kTeam) {
        this->template sum_chosen<kind>(chosen, 32 * warp, 32 * kTeam);
        looks_ += static_cast<std::uint32_t>(chosen);
        chosen = 0;
      }
      if (done) break;
      visits_ += 2 * static_cast<std::uint32_t>(takes(waiting));
      index = take<kind>(waiting, lanes);
    }
    __syncthreads();
  }

  /// Of so many nodes that wait, those that are gone below in one step.
  __device__ static int takes(int waiting) {
    constexpr int reserve = 64;  // what one node at a time, the smaller child first, may need
    return max_of(1, min_of(min_of(waiting, kTeamed ? 16 * kTeam : 16), Space::kStack - reserve - waiting));
  }

  /// Takes the nodes that were found last: this lane's child of one of them, or kNone.
  template <int kind>
  __device__ std::uint32_t take(int& waiting, unsigned& lanes) const {
    const int taken = takes(waiting), thread = kTeamed ? static_cast<int>(threadIdx.x) : lane_;
    const bool full = taken == 1 && waiting > 1;
    waiting -= taken;
    std::uint32_t index = kNone;
    if (thread < 2 * taken) {
      const PixelsNode top = space_.stack[waiting + thread / 2];
      index = top.index + static_cast<std::uint32_t>(thread % 2);
      lanes = top.lanes;
    }
    // The smaller child first: what waits then doubles with each entry.
    if (full) index = smaller_last(job_.trees.kind[kind].nodes, index);
    return index;
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

  __device__ void list(int kind, std::uint32_t node, unsigned lanes) const {
    const std::uint32_t place = atomicAdd(cuts_.listing.count, 1u);
    if (place >= cuts_.listing.capacity) return;
    cuts_.listing.nodes[place] = {tile_, walks_ + 1000 * static_cast<std::uint32_t>(crew), lanes,
                                  static_cast<std::uint32_t>(kind), node};
  }

  __device__ void add_counts() {
    atomicAdd(&cuts_.counts->pairs, static_cast<unsigned long long>(pairs_));
    if (lane_ != 0 || (kTeamed && threadIdx.x != 0)) return;
    atomicAdd(&cuts_.counts->visits, static_cast<unsigned long long>(visits_));
    if (warp_ != 0) return;
    atomicAdd(&cuts_.counts->walks, static_cast<unsigned long long>(walks_));
    atomicAdd(&cuts_.counts->groups, static_cast<unsigned long long>(groups_));
  }

  // This lane's pixel.
  std::uint32_t size_ = 0;
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

  std::uint32_t tile_ = 0;
  std::uint32_t visits_ = 0, looks_ = 0, walks_ = 0, groups_ = 0;
};

}  // namespace lightcuts::cuda
