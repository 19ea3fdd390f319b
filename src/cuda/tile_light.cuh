#pragma once

#include "cuda/crew.cuh"
#include "cuda/hidden_nodes.cuh"
#include "cuda/packet_cut.h"
#include "cuda/see.cuh"
#include "cuda/warp.cuh"

namespace lightcuts::cuda {

/// Where less than this share of the upper levels' light arrives, the few of them that do tell little.
inline constexpr float kUnsureArrival = 0.2f;

inline constexpr int kTeam = 8;  ///< warps of a block that lights a tile together

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

/// The shared memory of a warp that lights a tile alone, or of a block that does.
template <class Visibility, int warps>
struct CutSpace {
  static constexpr int kStack = 256 * warps;                      ///< nodes to go below
  static constexpr int kChosen = warps == 1 ? 256 : 128 * warps;  ///< nodes that wait for being summed

  WarpStage<Visibility> stages[warps];
  PixelsNode stack[kStack];  ///< first children of the nodes to go below
  PixelsNode chosen[kChosen];
  Umbras<Visibility::shadows> umbras;
  typename Visibility::Group group;
  std::uint32_t found[2][warps];  ///< by each warp in a step, of both: to go below, and chosen times 2^16
};

static_assert(sizeof(CrewPart) <= sizeof(StagedLight));  // a warp leaves its part in `lights`

/// What the pixels of a tile get of lights, a pixel a lane of each warp of the crew: the estimate from the trees' upper levels, and
/// the sum over nodes that were chosen.
template <class Visibility, Crew crew>
class TileLight {
 protected:
  static constexpr bool kOwnCuts = Visibility::own_cuts, kTeamed = crew != Crew::warp;
  using Space = CutSpace<Visibility, kTeamed ? kTeam : 1>;

  /// @param meeting  of the crew's blocks, if they are several
  __device__ TileLight(const CutJob& job, const Visibility& visibility, const CutView& cuts, Space& space,
                       Meeting* meeting)
      : job_(job),
        visibility_(visibility),
        cuts_(cuts),
        space_(space),
        stage_(space.stages[kTeamed ? threadIdx.x / 32 : 0]),
        meeting_(meeting),
        warp_(kTeamed ? static_cast<int>(threadIdx.x / 32) + (crew == Crew::blocks ? meeting->rank() * kTeam : 0) : 0),
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
  __device__ float total_of(Vec3T<double> light) const {
    const double total = weights_.x * light.x + weights_.y * light.y + weights_.z * light.z;
    return static_cast<float>(total > 0 ? fmin(total, 3e38) : 0);
  }

  // --- Sums ---

  /// Adds a light of the list, as far as it arrives.
  /// @param wanted  the pixel has this light in its cut
  template <int kind>
  __device__ void add_seen(const StagedLight& light, const typename Visibility::Staged& seen, bool wanted) {
    if (seen.share == 0) return;
    const LightFactor f = factor_of<kind>(receiver_, light, job_.min_distance * job_.min_distance);
    float share = 1;
    if constexpr (Visibility::shadows) {
      share = 0;
      if constexpr (Visibility::traces) {
        share = static_cast<float>(seen.sees >> lane_ & 1u);
        rays_ += seen.asks >> lane_ & 1u;
      } else if (wanted && f.unclamped > 0) {
        share = visibility_.template share<kind>(receiver_, position_, light, seen);
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

  // --- The crew ---

  __device__ int crew_blocks() const { return crew == Crew::blocks ? meeting_->blocks() : 1; }
  __device__ int crew_warps() const { return kTeamed ? kTeam * crew_blocks() : 1; }

  /// Adds up the parts of a crew's warps, in their order: all of them get the same.
  __device__ CrewPart add_up(const CrewPart& own) {
    __syncwarp();
    *part_of(stage_) = own;
    missed_ = __syncthreads_or(missed_ ? 1 : 0) != 0;
    heavy_ = __syncthreads_or(heavy_ ? 1 : 0) != 0;
    CrewPart sum;
    for (int w = 0; w < kTeam; ++w) sum.add(*part_of(space_.stages[w]));
    __syncthreads();
    if constexpr (crew == Crew::blocks) sum = meeting_->add_up(sum, missed_);
    return sum;
  }

  __device__ CrewPart* part_of(WarpStage<Visibility>& stage) const {
    return reinterpret_cast<CrewPart*>(stage.lights) + lane_;
  }

  // --- The estimate ---

  template <int kind>
  __device__ void add_frontier() {
    const TreeView& tree = job_.trees.kind[kind];
    const auto step = static_cast<std::uint32_t>(crew_warps());
    for (auto i = static_cast<std::uint32_t>(warp_); i < tree.frontier_count; i += step) {
      const StagedLight light = tree.frontier[i];
      add<kind>(light, factor_of<kind>(receiver_, light, job_.min_distance * job_.min_distance), 1);
    }
    if (warp_ == 0) pairs_ += tree.frontier_count;
  }

  /// A quarter of the upper level, each light from a quarter of the pixels: seen with and without shadows.
  template <int kind>
  __device__ void sample_frontier(float& offered, float& arrived) {
    const TreeView& tree = job_.trees.kind[kind];
    const std::uint32_t step = tree.frontier_count >= 32 ? 4 : 1;
    const auto warps = static_cast<std::uint32_t>(crew_warps());
    for (std::uint32_t i = static_cast<std::uint32_t>(warp_) * step; i < tree.frontier_count; i += step * warps) {
      const std::uint32_t own = min_of(i + static_cast<std::uint32_t>(lane_) % step, tree.frontier_count - 1);
      const StagedLight light = tree.frontier[own];
      const LightFactor f = factor_of<kind>(receiver_, light, job_.min_distance * job_.min_distance);
      if (!mine_ || !(f.unclamped > 0)) continue;
      const float power = dot(weights_, Vec3{light.red, light.green, light.blue}) * f.clamped;
      offered += power;
      typename Visibility::Staged seen;
      visibility_.template stage<kind>(light.light, 1, seen);
      arrived += power * visibility_.template share<kind>(receiver_, position_, light, seen);
      if (Visibility::traces) ++rays_;
    }
  }

  /// The pixel's total by the nodes of the trees' upper levels.
  __device__ float estimate() {
    add_frontier<vpl_kind>();
    add_frontier<point_kind>();
    add_frontier<directional_kind>();
    float total = total_of({block_.x, block_.y, block_.z});
    close_block(false);
    float offered = 0, arrived = 0;
    if constexpr (Visibility::shadows) {
      sample_frontier<vpl_kind>(offered, arrived);
      sample_frontier<point_kind>(offered, arrived);
      sample_frontier<directional_kind>(offered, arrived);
      offered = warp_sum(offered);
      arrived = warp_sum(arrived);
    }
    if constexpr (kTeamed) {
      CrewPart part;
      part.light = {total, offered, arrived};
      part.rays = rays_;
      const CrewPart sum = add_up(part);
      total = static_cast<float>(fmin(sum.light.x, 3e38));
      offered = static_cast<float>(sum.light.y);
      arrived = static_cast<float>(sum.light.z);
      rays_ = warp_ == 0 ? sum.rays : 0;
    }
    if (offered > 0) arrival_ = fmaxf(arrived / offered, 1.0f / 64);
    return total * arrival_;
  }

  // --- Chosen nodes ---

  /// Adds the light of this warp's share of the chosen nodes to each pixel of the group: 32 nodes, then the next 32 of every
  /// `step`.
  template <int kind>
  __device__ void sum_chosen(int count, int from, int step) {
    for (int first = from; first < count; first += step) {
      const int here = min_of(32, count - first);
      const PixelsNode* const chosen = space_.chosen + first;
      __syncwarp();
      if (lane_ < here) stage_chosen<kind>(chosen[lane_].index);
      if constexpr (Visibility::shadows) missed_ = __any_sync(kAllLanes, missed_) != 0;
      __syncwarp();
      if constexpr (Visibility::traces) trace_chosen<kind>(chosen, here);
      for (int i = 0; i < here; ++i) {
        const bool wanted = mine_ && (!kOwnCuts || (chosen[i].lanes >> lane_ & 1u) != 0);
        add_seen<kind>(stage_.lights[i], stage_.seen[i], wanted);
        if (wanted) ++pairs_;
      }
    }
    close_block(mine_);
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

  /// Traces the rays to the staged lights: where pixels have cuts of their own few of them ask for the same light, so the lanes
  /// share out all rays, sorted by light.
  template <int kind>
  __device__ void trace_chosen(const PixelsNode* chosen, int here) {
    unsigned own_asks = 0;
    for (int i = 0; i < here; ++i) {
      const bool wanted = (chosen[i].lanes >> lane_ & 1u) != 0;
      const LightFactor f = factor_of<kind>(receiver_, stage_.lights[i], job_.min_distance * job_.min_distance);
      const unsigned asks = __ballot_sync(kAllLanes, wanted && f.unclamped > 0);
      if (lane_ == i) own_asks = asks;
    }
    std::uint32_t upto = static_cast<std::uint32_t>(__popc(own_asks));
    for (int step = 1; step < 32; step *= 2) {
      const std::uint32_t other = __shfl_up_sync(kAllLanes, upto, step);
      if (lane_ >= step) upto += other;
    }
    const std::uint32_t rays = __shfl_sync(kAllLanes, upto, 31);
    stage_.seen[lane_].asks = own_asks;
    stage_.seen[lane_].sees = 0;
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
          visibility_.template share<kind>(receiver_, from, stage_.lights[light], stage_.seen[light]) > 0) {
        atomicOr(&stage_.seen[light].sees, 1u << pixel);
      }
    }
    __syncwarp();
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

  bool heavy_ = false;   ///< too many nodes for this crew
  bool missed_ = false;  ///< some light could not be looked at: what follows shows which else there will be
  float arrival_ = 1;    ///< share of the light that arrives at the tile, about
};

}  // namespace lightcuts::cuda
