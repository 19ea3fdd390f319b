#pragma once

#include "cuda/packet_cut.h"
#include "cuda/warp.cuh"
#include "kernels/occluder.h"

namespace lightcuts::cuda {

/// The umbras of the occluders that cover most of a group's sky, in the memory that a warp or block shares: what lies in one of
/// them gives nothing and needs no look. Of umbras that hide no sample of the lights that others do not hide
/// there are none, for every node is tested against each; as on the CPU.
template <int kMost>
struct Umbras {
  Umbra umbra[kMost];
  int count;

  /// By all lanes together: each has one of the umbras to find, of the occluders that weigh most.
  /// @param least  that one has to weigh
  __device__ void find(const CutJob& job, const Box& receivers, float least, int lane) {
    Box lights;
    if (job.trees.kind[vpl_kind].leaf_count > 0) lights = extend(lights, job.trees.kind[vpl_kind].nodes[0].box);
    if (job.trees.kind[point_kind].leaf_count > 0) lights = extend(lights, job.trees.kind[point_kind].nodes[0].box);
    const bool far_lights = job.trees.kind[directional_kind].leaf_count > 0;
    const OccluderView view =
        occluder_view(job.occluders, job.occluder_count, extend(job.scene_bounds, extend(receivers, lights)));
    // Weights first, and umbras of which it is not known yet whether they are wanted, lie where the umbras will.
    auto* const weights = reinterpret_cast<float*>(umbra);
    const auto rounds = static_cast<int>((view.count + 31) / 32);
    for (int k = 0; k < rounds; ++k) {
      const auto i = static_cast<std::uint32_t>(32 * k + lane);
      const bool counts = i < view.count && (far_lights || is_between(view.occluders[i], receivers, lights, view.gap));
      const float weight = counts ? occluder_weight(view.occluders[i], center(receivers)) : 0.0f;
      weights[i] = weight >= least ? weight : 0.0f;
    }
    const std::uint32_t own_occluder = one_of_the_heaviest(weights, rounds, lane);
    Umbra own;
    const bool found = own_occluder != kNone &&
                       find_umbra(view.occluders[own_occluder], receivers, view.rounding, view.gap, own) &&
                       (far_lights || touches_box(own, lights));
    __syncwarp();
    if (found) umbra[lane] = own;
    const Samples samples(job, lane);
    __syncwarp();
    unsigned long long hidden = 0;
    unsigned keeps = 0;
    for (unsigned left = __ballot_sync(kAllLanes, found); left != 0; left &= left - 1) {
      const int of = __ffs(static_cast<int>(left)) - 1;
      const unsigned long long there = samples.inside(umbra[of]);
      if (!far_lights && (there & ~hidden) == 0) continue;
      hidden |= there;
      keeps |= 1u << of;
    }
    __syncwarp();
    if ((keeps >> lane & 1u) != 0) umbra[__popc(keeps & ((1u << lane) - 1))] = own;
    if (lane == 0) count = __popc(keeps);
    __syncwarp();
  }

  template <int kind>
  __device__ bool hide(const Box& box) const {
    for (int i = 0; i < count; ++i) {
      if (kind == directional_kind ? hides_directions(umbra[i], box) : hides_box(umbra[i], box)) return true;
    }
    return false;
  }

 private:
  static_assert(sizeof umbra >= kMostOccluders * sizeof(float));

  __device__ static bool is_inside(const Umbra& umbra, Vec3 at) {
    bool inside = true;  // not for a plane that is not a number
    for (const HalfSpace& h : umbra.behind) inside &= dot(h.normal, at) + h.offset > 0;
    return inside;
  }

  /// At most 64 lights of the trees' upper levels, two a lane.
  class Samples {
   public:
    __device__ Samples(const CutJob& job, int lane) {
      const TreeView& vpls = job.trees.kind[vpl_kind];
      const TreeView& points = job.trees.kind[point_kind];
      const std::uint32_t all = vpls.frontier_count + points.frontier_count;
      for (std::uint32_t k = 0; k < 2; ++k) {
        const std::uint32_t number = 32 * k + static_cast<std::uint32_t>(lane);
        is_one_[k] = number < min_of(64u, all);
        if (!is_one_[k]) continue;
        const std::uint32_t i = all <= 64 ? number : number * all / 64;
        at_[k] =
            i < vpls.frontier_count ? vpls.frontier[i].position : points.frontier[i - vpls.frontier_count].position;
      }
    }

    /// Which of them lie in an umbra.
    [[nodiscard]] __device__ unsigned long long inside(const Umbra& umbra) const {
      const unsigned first = __ballot_sync(kAllLanes, is_one_[0] && is_inside(umbra, at_[0]));
      const unsigned second = __ballot_sync(kAllLanes, is_one_[1] && is_inside(umbra, at_[1]));
      return static_cast<unsigned long long>(second) << 32 | first;
    }

   private:
    Vec3 at_[2];
    bool is_one_[2];
  };

  /// Lane k's is the occluder of the k-th largest of 32 * rounds weights, kNone where that is 0; takes the weights away.
  __device__ static std::uint32_t one_of_the_heaviest(float* weights, int rounds, int lane) {
    float most = 0;
    int place = 0;
    const auto find_most = [&] {
      most = 0;
      for (int k = 0; k < rounds; ++k) {
        const float weight = weights[32 * k + lane];
        if (weight > most) {
          most = weight;
          place = k;
        }
      }
    };
    find_most();  // each lane reads only what it wrote
    std::uint32_t own = kNone;
    for (int k = 0; k < kMost; ++k) {
      const float heaviest = warp_max_positive(most);
      if (!(heaviest > 0)) break;
      const int winner = __ffs(static_cast<int>(__ballot_sync(kAllLanes, most == heaviest))) - 1;
      const int index = 32 * __shfl_sync(kAllLanes, place, winner) + winner;
      if (lane == k) own = static_cast<std::uint32_t>(index);
      if (lane == winner) {
        weights[index] = 0;
        find_most();
      }
      __syncwarp();
    }
    return own;
  }
};

/// Where all light arrives.
template <>
struct Umbras<0> {
  __device__ void find(const CutJob&, const Box&, float, int) {}
  template <int kind>
  __device__ bool hide(const Box&) const {
    return false;
  }
};

}  // namespace lightcuts::cuda
