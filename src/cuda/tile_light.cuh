#pragma once

#include "cuda/crew.cuh"
#include "cuda/hidden_nodes.cuh"
#include "cuda/packet_cut.h"
#include "cuda/see.cuh"
#include "cuda/warp.cuh"

namespace lightcuts::cuda {

/// Where less than this share of the upper levels' light arrives, the few of them that do tell little.
inline constexpr float kUnsureArrival = 0.2f;

inline constexpr int kTeam = 8;  ///< warps of a block that lights a group together

/// A node and the pixels that it concerns.
struct PixelsNode {
  std::uint32_t index;
  unsigned lanes;
};

/// What one warp knows of the lights that it is about to sum.
template <class Visibility>
struct WarpStage {
  StagedLight lights[32];
  typename Visibility::Staged seen[32];  ///< of `lights`
};

/// The shared memory of a warp that lights a group alone, or of a block that does.
template <class Visibility, int warps>
struct CutSpace {
  static constexpr int kStack = 256 * warps;                      ///< nodes to go below
  static constexpr int kChosen = warps == 1 ? 256 : 128 * warps;  ///< nodes that wait for being summed

  WarpStage<Visibility> stages[warps];
  PixelsNode stack[kStack];  ///< first children of the nodes to go below
  PixelsNode chosen[kChosen];
  Umbras<Visibility::most_umbras> umbras;
  typename Visibility::Group group;
  std::uint32_t found[2][warps];  ///< by each warp in a step, of both: to go below, and chosen times 2^16
};

static_assert(sizeof(CrewPart) <= sizeof(StagedLight));  // a warp leaves its part in `lights`

/// What a group of a tile's pixels gets of lights, a pixel a lane of each warp of the crew: the estimate from the
/// trees' upper levels, and the sum over nodes that were chosen.
template <class Visibility, Crew crew>
class TileLight {
 protected:
  static constexpr bool kOwnCuts = Visibility::own_cuts, kTeamed = crew != Crew::warp;
  using Space = CutSpace<Visibility, kTeamed ? kTeam : 1>;

  /// @param meeting  of the crew's blocks, if they are several
  __device__ TileLight(const CutJob& job, const Visibility& visibility, const CutView& cuts, Space& space,
                       const RememberedRays& remembered, Meeting* meeting)
      : job_(job),
        visibility_(visibility),
        cuts_(cuts),
        space_(space),
        stage_(space.stages[kTeamed ? threadIdx.x / 32 : 0]),
        meeting_(meeting),
        remembered_(remembered),
        warp_(kTeamed ? static_cast<int>(threadIdx.x / 32) + meeting->rank() * kTeam : 0),
        lane_(static_cast<int>(threadIdx.x % 32)) {}

  // --- The pixel ---

  __device__ void open_pixel(const PixelView& pixels, std::uint32_t slot) {
    const Vec3 ns = pixels.ns[slot], albedo = pixels.albedo[slot];
    position_ = pixels.position[slot];
    receiver_ = {fast(position_), fast(ns), fast(pixels.ng[slot])};
    mine_ = !(ns == Vec3{});
    weights_ = mine_ ? Vec3{0.2126f * albedo.x, 0.7152f * albedo.y, 0.0722f * albedo.z} : Vec3{};
  }

  __device__ Vec3 ns() const { return {receiver_.ns.x.value, receiver_.ns.y.value, receiver_.ns.z.value}; }
  __device__ Vec3 ng() const { return {receiver_.ng.x.value, receiver_.ng.y.value, receiver_.ng.z.value}; }

  /// Luminance of what a pixel reflects, times pi.
  __device__ float total_of(Vec3 light) const { return total_of(Vec3T<double>{light.x, light.y, light.z}); }
  __device__ float total_of(Vec3T<double> light) const {
    const double total = weights_.x * light.x + weights_.y * light.y + weights_.z * light.z;
    return static_cast<float>(total > 0 ? fmin(total, 3e38) : 0);
  }

  // --- Sums ---

  /// Adds the share that arrives of a light.
  template <int kind>
  __device__ void add(const StagedLight& light, LightFactor f, float share) {
    const float arrives = f.clamped * share;
    block_ += Vec3{light.red, light.green, light.blue} * arrives;
    if constexpr (kind == vpl_kind) {
      const float lost = f.unclamped - f.clamped;
      if (lost > 0) block_lost_ += luminance(Vec3{light.red, light.green, light.blue}) * lost * share;
    }
  }

  template <int kind>
  __device__ LightFactor factor_here(const StagedLight& light) const {
    return factor_of<kind>(receiver_, light, job_.min_distance * job_.min_distance);
  }

  /// Adds those of the staged lights of which the share that arrives is known, two at a time: so each waits less for
  /// the other.
  template <int kind>
  __device__ void add_known(unsigned known, const PixelsNode* chosen) {
    const auto take = [&known] {
      const int i = __ffs(static_cast<int>(known)) - 1;
      known &= known - 1;
      return i;
    };
    while (known != 0) {
      const int i = take(), j = known != 0 ? take() : -1;
      const StagedLight &first = stage_.lights[i], &second = stage_.lights[j < 0 ? i : j];
      const LightFactor f = factor_here<kind>(first), g = factor_here<kind>(second);
      add<kind>(first, f, share_of(i, chosen));
      add<kind>(second, g, j < 0 ? 0.0f : share_of(j, chosen));
    }
  }

  /// What arrives at this pixel of a staged light of which that is known.
  __device__ float share_of(int i, const PixelsNode* chosen) const {
    if constexpr (Visibility::traces) {
      return static_cast<float>(stage_.seen[i].sees >> lane_ & 1u);
    } else if constexpr (kOwnCuts) {
      return static_cast<float>(chosen[i].lanes >> lane_ & 1u);
    } else {
      return stage_.seen[i].share;
    }
  }

  /// Adds those of the staged lights that each pixel has to look at by itself.
  template <int kind>
  __device__ void add_looked_at(unsigned open) {
    for (; open != 0; open &= open - 1) {
      const int i = __ffs(static_cast<int>(open)) - 1;
      const StagedLight& light = stage_.lights[i];
      const LightFactor f = factor_here<kind>(light);
      if (mine_ && f.unclamped > 0) {
        add<kind>(light, f, visibility_.template share<kind>(receiver_, position_, lane_, light, stage_.seen[i]));
      }
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

  // --- The crew ---

  /// Adds up the parts of a crew's warps, in their order: all of them get the same.
  __device__ CrewPart add_up(const CrewPart& own) {
    __syncwarp();
    *part_of(stage_) = own;
    CrewFlags flags{__syncthreads_or(missed_ ? 1 : 0) != 0, heavy_};
    CrewPart sum;
    for (int w = 0; w < kTeam; ++w) sum.add(*part_of(space_.stages[w]));
    __syncthreads();
    sum = meeting_->add_up(sum, flags);
    missed_ = flags.missed;
    heavy_ = flags.heavy;
    return sum;
  }

  __device__ CrewPart* part_of(WarpStage<Visibility>& stage) const {
    return reinterpret_cast<CrewPart*>(stage.lights) + lane_;
  }

  // --- The estimate ---

  static constexpr int kProbes = 4;  ///< pixels of a group that tell what the upper levels give it

  /// One of a group's pixels, the same for each eight lanes.
  struct Probe {
    int pixel;
    Receiver<FastFloat> receiver;
    Vec3 position, weights;
  };
  __device__ Probe probe_of(unsigned lanes) const {
    const int pixel = place_of_bit(lanes, static_cast<std::uint32_t>(lane_ / 8 * (__popc(lanes) - 1) / (kProbes - 1)));
    const Vec3 position = from_lane(position_, pixel);
    return {pixel,
            {fast(position), fast(from_lane(ns(), pixel)), fast(from_lane(ng(), pixel))},
            position,
            from_lane(weights_, pixel)};
  }

  template <int kind>
  __device__ void add_frontier(const Probe& probe, Vec3& light) {
    const TreeView& tree = job_.trees.kind[kind];
    if (warp_ == 0) pairs_ += tree.frontier_count * kProbes / 32;
#pragma unroll 1
    for (auto i = static_cast<std::uint32_t>(lane_ % 8); i < tree.frontier_count; i += 8) {
      const StagedLight staged = tree.frontier[i];
      const LightFactor f = factor_of<kind>(probe.receiver, staged, job_.min_distance * job_.min_distance);
      light += Vec3{staged.red, staged.green, staged.blue} * f.clamped;
    }
  }

  /// Each light of the upper level, if they are many, by one of the probes: seen with and without shadows.
  template <int kind>
  __device__ void sample_frontier(const Probe& probe, float& offered, float& arrived) {
    const TreeView& tree = job_.trees.kind[kind];
    const std::uint32_t step = tree.frontier_count >= 32 ? kProbes : 1;
#pragma unroll 1
    for (std::uint32_t i = step * (lane_ % 8) + lane_ / 8 % step; i < tree.frontier_count; i += 8 * step) {
      const StagedLight light = tree.frontier[i];
      const LightFactor f = factor_of<kind>(probe.receiver, light, job_.min_distance * job_.min_distance);
      if (!(f.unclamped > 0)) continue;
      const float power = dot(probe.weights, Vec3{light.red, light.green, light.blue}) * f.clamped;
      offered += power;
      typename Visibility::Staged seen;
      visibility_.template stage<kind>(light.light, 1, seen);
      arrived += power * visibility_.template share<kind>(probe.receiver, probe.position, probe.pixel, light, seen);
      if (Visibility::traces && warp_ == 0) ++rays_;
    }
  }

  /// What a group's pixels get of the nodes of the trees' upper levels: the least and the most at some of them.
  struct Estimate {
    Vec3 least, most;
  };
  /// Each warp of a crew finds the same.
  __device__ Estimate estimate(unsigned lanes) {
    const Probe probe = probe_of(lanes);
    Vec3 light;
    add_frontier<vpl_kind>(probe, light);
    add_frontier<point_kind>(probe, light);
    add_frontier<directional_kind>(probe, light);
    for (int step = 1; step < 8; step *= 2) light += from_other(light, step);
    if constexpr (Visibility::shadows) {
      float offered = 0, arrived = 0;
      sample_frontier<vpl_kind>(probe, offered, arrived);
      sample_frontier<point_kind>(probe, offered, arrived);
      sample_frontier<directional_kind>(probe, offered, arrived);
      offered = warp_sum(offered);
      arrived = warp_sum(arrived);
      arrival_ = offered > 0 ? fmaxf(arrived / offered, 1.0f / 64) : 1.0f;
      light = light * arrival_;
    }
    Estimate found{light, light};
    for (int step = 8; step < 32; step *= 2) {
      found.least = min_of(found.least, from_other(found.least, step));
      found.most = max_of(found.most, from_other(found.most, step));
    }
    return found;
  }

  __device__ static Vec3 from_other(Vec3 v, int step) {
    return {__shfl_xor_sync(kAllLanes, v.x, step), __shfl_xor_sync(kAllLanes, v.y, step),
            __shfl_xor_sync(kAllLanes, v.z, step)};
  }

  // --- Chosen nodes ---

  /// Adds the light of this warp's share of the chosen nodes to each pixel of the group: 32 nodes, then the next 32 of
  /// every `step`.
  template <int kind>
  __device__ void sum_chosen(int count, int from, int step) {
    for (int first = from; first < count; first += step) {
      const int here = min_of(32, count - first);
      const PixelsNode* const chosen = space_.chosen + first;
      __syncwarp();
      if (lane_ < here) stage_chosen<kind>(chosen[lane_].index);
      if constexpr (Visibility::shadows) missed_ = __any_sync(kAllLanes, missed_) != 0;
      __syncwarp();
      if constexpr (Visibility::traces) {
        trace_chosen<kind>(chosen, here);
        if constexpr (!kTeamed) looks_ += static_cast<std::uint32_t>(Visibility::look_tests * here);
        add_known<kind>(__ballot_sync(kAllLanes, lane_ < here && stage_.seen[lane_].sees != 0), chosen);
      } else {
        const float share = lane_ < here ? stage_.seen[lane_].share : 0.0f;
        add_known<kind>(__ballot_sync(kAllLanes, share > 0), chosen);
        if constexpr (Visibility::shadows) {
          const unsigned open = __ballot_sync(kAllLanes, share < 0);
          add_looked_at<kind>(open);
          if constexpr (!kTeamed) count_looks(here, open);
        }
        if (mine_) pairs_ += static_cast<std::uint32_t>(here);
      }
    }
    close_block(mine_);
  }

  /// @param open  lights that each pixel looks at by itself
  __device__ void count_looks(int here, unsigned open) {
    int tests = Visibility::look_tests * here;
    if constexpr (Visibility::by_maps) {
      const bool whole = (open >> lane_ & 1u) != 0 && visibility_.looks_at_all(stage_.seen[lane_]);
      tests +=
          Visibility::place_tests * __popc(open) + Visibility::own_look_tests * __popc(__ballot_sync(kAllLanes, whole));
    }
    looks_ += static_cast<std::uint32_t>(tests);
  }

  /// Reads what the pixels need to know of a node's light, a light a lane.
  template <int kind>
  __device__ void stage_chosen(std::uint32_t index) {
    const LightNode& node = job_.trees.kind[kind].nodes[index];
    const std::uint32_t light = node.representative;
    stage_.lights[lane_] = stage_light<kind>(job_.lights, light, node.intensity);
    if (cuts_.used[kind] != nullptr && !missed_) mark(cuts_.used[kind], light);
    typename Visibility::Staged seen;
    if (!visibility_.template stage<kind>(light, fmaxf(arrival_, kUnsureArrival), seen)) missed_ = true;
    visibility_.template look<kind>(space_.group, seen);
    stage_.seen[lane_] = seen;
  }

  /// Traces the rays to the staged lights: where pixels have cuts of their own few of them ask for the same light, so
  /// the lanes share out all rays, sorted by light.
  template <int kind>
  __device__ void trace_chosen(const PixelsNode* chosen, int here) {
    const RememberedRays::Rays before =
        lane_ < here ? remembered_.of(kind, stage_.lights[lane_].light) : RememberedRays::Rays{};
    unsigned asks = 0;
    for (int i = 0; i < here; ++i) {
      const bool wanted = (chosen[i].lanes >> lane_ & 1u) != 0;
      const LightFactor f = factor_here<kind>(stage_.lights[i]);
      const bool asked = wanted && f.unclamped > 0;
      const unsigned all = __ballot_sync(kAllLanes, asked), traced = __shfl_sync(kAllLanes, before.traced, i);
      if (lane_ == i) asks = all;
      if (wanted) ++pairs_;
      if (asked && (traced >> lane_ & 1u) == 0) ++rays_;
    }
    const unsigned own_asks = asks & ~before.traced;
    std::uint32_t upto = static_cast<std::uint32_t>(__popc(own_asks));
    for (int step = 1; step < 32; step *= 2) {
      const std::uint32_t other = __shfl_up_sync(kAllLanes, upto, step);
      if (lane_ >= step) upto += other;
    }
    const std::uint32_t rays = __shfl_sync(kAllLanes, upto, 31);
    stage_.seen[lane_].asks = own_asks;
    stage_.seen[lane_].sees = asks & before.arrived;
    stage_.seen[lane_].before = upto - static_cast<std::uint32_t>(__popc(own_asks));
    __syncwarp();
    for (std::uint32_t begin = 0; begin < rays; begin += 32) {
      const std::uint32_t ray = min_of(begin + static_cast<std::uint32_t>(lane_), rays - 1);
      int light = 0;
      for (int step = 16; step > 0; step /= 2) {
        if (stage_.seen[light + step].before <= ray) light += step;
      }
      const int pixel = place_of_bit(stage_.seen[light].asks, ray - stage_.seen[light].before);
      const Vec3 from = from_lane(position_, pixel);
      if (begin + static_cast<std::uint32_t>(lane_) < rays &&
          visibility_.template share<kind>(receiver_, from, pixel, stage_.lights[light], stage_.seen[light]) > 0) {
        atomicOr(&stage_.seen[light].sees, 1u << pixel);
      }
    }
    __syncwarp();
    if (lane_ < here) {
      remembered_.add(kind, stage_.lights[lane_].light, {own_asks, stage_.seen[lane_].sees & own_asks});
    }
  }

  /// Place of the n-th bit that is set, from 0.
  __device__ static int place_of_bit(unsigned bits, std::uint32_t n) {
    int place = 0;
    for (int step = 16; step > 0; step /= 2) {
      const auto below = static_cast<std::uint32_t>(__popc(bits >> place & ((1u << step) - 1)));
      if (n >= below) {
        n -= below;
        place += step;
      }
    }
    return place;
  }

  __device__ static void mark(std::uint32_t* bits, std::uint32_t light) {
    const std::uint32_t bit = 1u << light % 32;
    if ((bits[light / 32] & bit) == 0) atomicOr(&bits[light / 32], bit);
  }

  const CutJob& job_;
  const Visibility& visibility_;
  const CutView& cuts_;
  Space& space_;
  WarpStage<Visibility>& stage_;
  Meeting* meeting_;
  RememberedRays remembered_;
  int warp_, lane_;  ///< of the crew, of the warp

  // This lane's pixel.
  Receiver<FastFloat> receiver_;
  Vec3 position_, weights_;
  bool mine_ = false;  ///< belongs to the group that is lit now
  Vec3T<double> light_{};
  double lost_ = 0;
  Vec3 block_{};
  float block_lost_ = 0;
  std::uint32_t rays_ = 0, pairs_ = 0;

  bool heavy_ = false;       ///< too much for the warp, or the crew
  std::uint32_t looks_ = 0;  ///< what looks of the group took, in tests of nodes
  bool missed_ = false;      ///< some light could not be looked at: what follows shows which else there will be
  float arrival_ = 1;        ///< share of the light that arrives at the tile, about
};

}  // namespace lightcuts::cuda
