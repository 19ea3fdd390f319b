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
/// By how much a first threshold is raised that made a walk long, for the estimate may be far too low, and by how much
/// a crew's is from the start.
inline constexpr float kDoubt = 16;
/// Walks after which a threshold is 0: every light counts by itself, which keeps any promise.
inline constexpr int kMostRounds = 16;
/// Of the threshold of a group that misses maps: down to this part of it the group asks for maps, in case less light
/// arrives than was guessed.
inline constexpr float kMoreMaps = 0.5f;
/// Nodes that wait, for each block of a crew, from which on they are shared out.
inline constexpr int kSharedNodes = 64;

/// Why a group is not lit, if it is not.
struct GroupRest {
  bool heavy = false;   ///< it is too much for the warp, or the crew
  bool missed = false;  ///< not all of its lights could be looked at (maps missing); it may be heavy, too
};

/// Lights a group of a tile's pixels, a pixel a lane of each warp of the crew.
///
/// Where Visibility::own_cuts, a node that the group as a whole refuses is tested for each pixel too: every pixel has a
/// cut of its own then.
template <class Visibility, bool listing = false, Crew crew = Crew::warp>
class TileCut : TileLight<Visibility, crew> {
  using Base = TileLight<Visibility, crew>;
  using Base::job_, Base::visibility_, Base::cuts_, Base::space_, Base::warp_, Base::lane_, Base::remembered_,
      Base::meeting_;
  using Base::kOwnCuts, Base::kTeamed;
  using Base::light_, Base::lost_, Base::rays_, Base::pairs_, Base::heavy_, Base::missed_, Base::arrival_, Base::looks_;
  using Base::receiver_, Base::position_, Base::weights_, Base::mine_, Base::ns, Base::ng, Base::total_of;
  using typename Base::Space;

 public:
  /// @param meeting  of the crew's blocks, if they are several
  __device__ TileCut(const CutJob& job, const Visibility& visibility, const CutView& cuts, Space& space,
                     const RememberedRays& remembered, Meeting* meeting = nullptr)
      : Base(job, visibility, cuts, space, remembered, meeting) {}

  /// Lights a group, unless it is left: then nothing is written of it. The tile's first group also writes empty cuts
  /// for the tile's pixels that see nothing.
  /// @param missed  it misses lights: it is walked only to find out which others it will miss
  __device__ GroupRest run(const PixelView& pixels, const SumView& sums, std::uint32_t group, bool missed) {
    tile_ = group / kTileGroups;
    const std::uint32_t slot = tile_ * kTilePixels + static_cast<std::uint32_t>(lane_);
    this->open_pixel(pixels, slot);
    if (!mine_ && group % kTileGroups == 0 && !kTeamed && !Visibility::asks) leave_cut(slot, 0, 0, false);
    const unsigned lanes = job_.groups[group];
    if (lanes == 0) return {};
    missed_ = missed;
    light_group(lanes);
    if (cuts_.cost != nullptr && warp_ == 0 && lane_ == 0) {
      std::uint32_t cost = work();
      if constexpr (kTeamed) cost *= static_cast<std::uint32_t>(meeting_->blocks());
      cuts_.cost[group] = max_of(cuts_.cost[group], cost);
    }
    if (missed_ || heavy_ || Visibility::asks) return {heavy_, missed_};
    if (cuts_.counts != nullptr) add_counts();
    if (kTeamed && warp_ > 0) return {};
    if ((lanes >> lane_ & 1u) != 0) {
      sums.light[slot] += light_;
      sums.lost[slot] += lost_;
      sums.rays[slot] += rays_;
      leave_cut(slot, size_, bound_, at_limit_);
    }
    return {};
  }

 private:
  __device__ void leave_cut(std::uint32_t slot, std::uint32_t size, float bound, bool at_limit) const {
    cuts_.size[slot] = size;
    cuts_.bound[slot] = bound;
    cuts_.at_limit[slot] = at_limit ? 1 : 0;
  }

  /// What was done for the group, in tests of nodes.
  __device__ std::uint32_t work() const { return visits_ + looks_; }
  /// So much that the group is left to a crew, or a larger one. The same for all warps of a block.
  __device__ bool too_heavy() const { return cuts_.left.entries != nullptr && work() > job_.work.most; }

  /// Whether a warp's first walk is long enough to doubt its threshold.
  __device__ bool doubts() const { return !kTeamed && !certain_ && work() > job_.work.doubt; }

  /// Waits for the others that share the space.
  __device__ static void meet() {
    if constexpr (kTeamed) {
      __syncthreads();
    } else {
      __syncwarp();
    }
  }

  // --- The group ---

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
      if (!kTeamed || threadIdx.x < 32) space_.umbras.find(job_, box, Visibility::least_occluder, lane_);
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
  // What is long is written, and compiled, in one place: a kernel whose loops do not fit into the instruction cache
  // waits for instructions.

  __device__ void light_group(unsigned group) {
    unsigned lanes = group;
    const float error = static_cast<float>(job_.error * (1 - kThresholdSlack));
    float threshold = 0;
    for (int round = 1; lanes != 0; ++round) {
      mine_ = (lanes >> lane_ & 1u) != 0;
      lanes_ = lanes;
      gather_group(lanes, round == 1);
      if (round == 1) {
        threshold = error * first_total(lanes) * (kTeamed && !Visibility::asks ? kDoubt : 1.0f);
        certain_ = Visibility::asks || job_.max_cut > 0;  // a search for the largest cut has many walks
      }
      scale_ = demands(threshold);
      threshold_ = threshold;
      const bool limited = walk_until_it_fits();
      if (asks_more_) heavy_ = false;
      if (heavy_ || Visibility::asks || asks_more_) return;
      ++walks_;
      if (doubts()) {
        threshold *= kDoubt;
        certain_ = true;
        continue;
      }
      certain_ = true;
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
      if constexpr (Visibility::by_maps) {
        if (lanes != 0 || limited || !missed_) continue;
        // Should less light arrive through the maps that are missing, it will miss others: it asks for these now.
        asks_more_ = true;
        lanes = group;
        threshold = kMoreMaps * error * seen;
      }
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

  /// Walks once, and where a cut must not be larger than allowed first until a threshold is found at which it is not;
  /// returns whether that is a higher one. Leaves found_, the largest bounds and the pixels' light.
  __device__ bool walk_until_it_fits() {
    FitSearch search;
    bool counting = job_.max_cut > 0 && !asks_more_;
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

  template <int kind>
  __device__ void walk_tree(bool counting) {
    if (job_.trees.kind[kind].leaf_count == 0) return;
    if constexpr (kTeamed) {
      walk_together<kind>(counting);
    } else {
      walk<kind>(counting);
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

  /// Whether what is accepted now counts as this block's, and not as another's that does the same.
  [[nodiscard]] __device__ bool ours() const { return !kTeamed || ours_; }

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
    if (ours()) count_found(__ballot_sync(kAllLanes, accepts), lanes);
    tested.taking = accepts ? lanes : 0;
    tested.lanes = lanes;
    if constexpr (kOwnCuts) {
      const unsigned taken = take_one_by_one<kind>(nodes, index, lanes, __ballot_sync(kAllLanes, tested.splits));
      tested.taking |= taken;
      tested.lanes &= ~taken;
      tested.splits = tested.splits && tested.lanes != 0;
    }
    if constexpr (listing) {
      if (!counting && ours() && tested.taking != 0) list(kind, index, tested.taking);
    }
    // What cannot shine at any pixel of the group is in the cut, but needs no look.
    tested.looks = !counting && ours() && tested.taking != 0 && shines;
    if constexpr (Visibility::by_maps) {
      if (Visibility::asks || asks_more_) {
        if (tested.looks) visibility_.template ask<kind>(nodes[index].representative);
        tested.looks = false;
      }
    }
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
      const bool done = waiting == 0 || too_heavy() || doubts();
      if (done || chosen > Space::kChosen - 32) {
        this->template sum_chosen<kind>(chosen, 0, 32);
        chosen = 0;
      }
      if (done) break;
      index = take<kind>(waiting, lanes);
      __syncwarp();
    }
    __syncwarp();
  }

  /// All warps of a block share what waits and what was chosen, so all have as much to do; places are given in the
  /// order of threads, so that sums are always the same.
  ///
  /// All blocks of a crew begin with the same steps, from the parts that the tree was taken apart into: what is
  /// accepted then counts as the first one's. Once enough nodes wait they are shared out: parts themselves would not
  /// do, as what is dear to a group lies in few of them, those next to it.
  template <int kind>
  __device__ void walk_together(bool counting) {
    const unsigned before = (1u << lane_) - 1;
    const int thread = static_cast<int>(threadIdx.x), warp = thread / 32, blocks = meeting_->blocks();
    const bool whole = job_.max_cut > 0;  // the parts alone may be more than a largest cut
    const int parts = whole ? 1 : static_cast<int>(kTreeParts);
    const std::uint32_t* const part = job_.trees.kind[kind].parts;
    bool shared = blocks == 1;
    ours_ = shared || meeting_->rank() == 0;
    int begun = 0, waiting = 0, chosen = 0;
    int gone = 0;  // nodes below those that wait, while all blocks do the same
    std::uint32_t index = kNone;
    unsigned lanes = lanes_;
    for (int step = 0;; ++step) {
      if (begun < parts) {
        index = whole ? (thread == 0 ? 0 : kNone) : part[begun + thread];
        lanes = lanes_;
        begun += kTeam * 32;
        visits_ += static_cast<std::uint32_t>(__syncthreads_count(index != kNone ? 1 : 0));
      } else if (shared) {
        visits_ += 2 * static_cast<std::uint32_t>(takes(waiting));
        index = take<kind>(waiting, lanes);
      } else {
        visits_ += 2 * static_cast<std::uint32_t>(min_of(waiting, kTeam * 16));
        index = take_first(gone, waiting, lanes);
      }
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
        space_.stack[gone + waiting + static_cast<int>(others & 0xffffu) + __popc(splitting & before)] = {tested.below,
                                                                                                          tested.lanes};
      }
      if (tested.looks) {
        space_.chosen[chosen + static_cast<int>(others >> 16) + __popc(looking & before)] = {index, tested.taking};
      }
      waiting += static_cast<int>(all & 0xffffu);
      chosen += static_cast<int>(all >> 16);
      __syncthreads();
      const bool full = gone + waiting > Space::kStack - 32 * kTeam;
      if (!shared && begun >= parts && (waiting >= kSharedNodes * blocks || full)) {
        waiting = keep_share(gone, waiting);
        shared = ours_ = true;
        gone = 0;
      }
      const bool done = (waiting == 0 && begun >= parts) || too_heavy();
      if (done || chosen > Space::kChosen - 32 * kTeam) {
        this->template sum_chosen<kind>(chosen, 32 * warp, 32 * kTeam);
        looks_ += Visibility::crew_look_tests * static_cast<std::uint32_t>(chosen);
        chosen = 0;
      }
      if (done) break;
    }
    __syncthreads();
  }

  /// Takes the nodes that were found first: this thread's child of one of them, or kNone.
  __device__ std::uint32_t take_first(int& gone, int& waiting, unsigned& lanes) const {
    const int taken = min_of(waiting, kTeam * 16), thread = static_cast<int>(threadIdx.x);
    std::uint32_t index = kNone;
    if (thread < 2 * taken) {
      const PixelsNode node = space_.stack[gone + thread / 2];
      index = node.index + static_cast<std::uint32_t>(thread % 2);
      lanes = node.lanes;
    }
    gone += taken;
    waiting -= taken;
    return index;
  }

  /// Keeps every n-th of the nodes that wait, n being the crew's blocks, at the stack's begin, and leaves the others to
  /// the crew's other blocks; returns how many.
  __device__ int keep_share(int gone, int waiting) const {
    const int step = meeting_->blocks(), kept = (waiting - meeting_->rank() + step - 1) / step;
    for (int done = 0; done < kept; done += kTeam * 32) {
      const int place = done + static_cast<int>(threadIdx.x);
      PixelsNode node{};
      if (place < kept) node = space_.stack[gone + meeting_->rank() + place * step];
      __syncthreads();
      if (place < kept) space_.stack[place] = node;
      __syncthreads();
    }
    return kept;
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
        if (ours()) ++found_;
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
    const std::uint32_t who = !kTeamed ? 0 : cuts_.left.entries != nullptr ? 1 : 2;  // each after those before
    cuts_.listing.nodes[place] = {tile_, walks_ + 1000 * who, lanes, static_cast<std::uint32_t>(kind), node};
  }

  /// Of a group.
  __device__ void add_counts() const {
    std::uint32_t pairs = pairs_;
    for (int step = 16; step > 0; step /= 2) pairs += __shfl_xor_sync(kAllLanes, pairs, step);
    if (lane_ != 0) return;
    atomicAdd(&cuts_.counts->pairs, static_cast<unsigned long long>(pairs));
    if (kTeamed && threadIdx.x != 0) return;
    atomicAdd(&cuts_.counts->visits, static_cast<unsigned long long>(visits_));
    if (warp_ != 0) return;
    atomicAdd(&cuts_.counts->walks, static_cast<unsigned long long>(walks_));
    atomicAdd(&cuts_.counts->groups, 1ull);
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
  bool ours_ = true;
  bool certain_ = false;    ///< a walk told the total, or its threshold was raised
  bool asks_more_ = false;  ///< it only marks lights whose maps are missing

  std::uint32_t tile_ = 0;
  std::uint32_t visits_ = 0;  ///< of the group
  std::uint32_t walks_ = 0;
};

}  // namespace lightcuts::cuda
