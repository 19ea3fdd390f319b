#pragma once

#include "cuda/packet_cut.h"
#include "cuda/warp.cuh"
#include "kernels/occluder.h"

namespace lightcuts::cuda {

/// The umbras of the occluders that cover most of a group's sky, in the memory that a warp or block shares: what lies in one of
/// them gives nothing and needs no look. Of umbras that hide no sample of the lights that others do not hide
/// there are none, for every node is tested against each; as on the CPU.
template <bool wanted>
struct Umbras {
  static constexpr int kMost = 32;

  Umbra umbra[kMost];
  int count;

  /// By all lanes together: each has one of the umbras to find, of the occluders that weigh most, as on the CPU.
  __device__ void find(const CutJob& job, const Box& receivers, int lane) {
    Box lights;
    if (job.trees.kind[vpl_kind].leaf_count > 0) lights = extend(lights, job.trees.kind[vpl_kind].nodes[0].box);
    if (job.trees.kind[point_kind].leaf_count > 0) lights = extend(lights, job.trees.kind[point_kind].nodes[0].box);
    const bool far_lights = job.trees.kind[directional_kind].leaf_count > 0;
    const OccluderView view =
        occluder_view(job.occluders, job.occluder_count, extend(job.scene_bounds, extend(receivers, lights)));
    const Vec3 middle = center(receivers);
    float weights[kEach];
    for (int k = 0; k < kEach; ++k) {
      const auto i = static_cast<std::uint32_t>(32 * k + lane);
      const bool counts = i < view.count && (far_lights || is_between(view.occluders[i], receivers, lights, view.gap));
      weights[k] = counts ? occluder_weight(view.occluders[i], middle) : 0.0f;
    }
    const std::uint32_t own_occluder = one_of_the_heaviest(weights, lane);
    Umbra own;
    const bool found = own_occluder != kNone &&
                       find_umbra(view.occluders[own_occluder], receivers, view.rounding, view.gap, own) &&
                       (far_lights || touches_box(own, lights));
    const unsigned long long hides = found ? hidden_samples(job, own) : 0;
    unsigned long long hidden = 0;
    unsigned keeps = 0;
    for (unsigned left = __ballot_sync(kAllLanes, found); left != 0; left &= left - 1) {
      const int of = __ffs(static_cast<int>(left)) - 1;
      const unsigned long long there = __shfl_sync(kAllLanes, hides, of);
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
  static constexpr int kEach = kMostOccluders / 32;

  __device__ static bool is_inside(const Umbra& umbra, Vec3 at) {
    bool inside = true;
    for (const HalfSpace& h : umbra.behind) inside = inside && dot(h.normal, at) + h.offset > 0;
    return inside;
  }

  /// Which of 64 lights of the trees' upper levels lie in an umbra.
  __device__ static unsigned long long hidden_samples(const CutJob& job, const Umbra& umbra) {
    constexpr std::uint32_t samples = 64;
    const TreeView& vpls = job.trees.kind[vpl_kind];
    const TreeView& points = job.trees.kind[point_kind];
    const std::uint32_t all = vpls.frontier_count + points.frontier_count;
    unsigned long long hidden = 0;
    for (std::uint32_t k = 0; k < min_of(samples, all); ++k) {
      const std::uint32_t i = all <= samples ? k : k * all / samples;
      const Vec3 at =
          i < vpls.frontier_count ? vpls.frontier[i].position : points.frontier[i - vpls.frontier_count].position;
      hidden |= is_inside(umbra, at) ? 1ull << k : 0ull;
    }
    return hidden;
  }

  /// Lane k's is the occluder of the k-th largest weight of all lanes', kNone where that is 0; takes the weights away.
  __device__ static std::uint32_t one_of_the_heaviest(float (&weights)[kEach], int lane) {
    std::uint32_t own = kNone;
    for (int k = 0; k < kMost; ++k) {
      float most = weights[0];
      for (int i = 1; i < kEach; ++i) most = fmaxf(most, weights[i]);
      const float heaviest = warp_max(most);
      if (!(heaviest > 0)) break;
      const int winner = __ffs(static_cast<int>(__ballot_sync(kAllLanes, most == heaviest))) - 1;
      int place = kEach;
      for (int i = kEach - 1; i >= 0; --i) {
        if (weights[i] == heaviest) place = i;
      }
      if (lane == winner) {
        for (int i = 0; i < kEach; ++i) {
          if (i == place) weights[i] = 0;
        }
      }
      const std::uint32_t index = static_cast<std::uint32_t>(32 * __shfl_sync(kAllLanes, place, winner) + winner);
      if (lane == k) own = index;
    }
    return own;
  }
};

/// Where all light arrives.
template <>
struct Umbras<false> {
  __device__ void find(const CutJob&, const Box&, int) {}
  template <int kind>
  __device__ bool hide(const Box&) const {
    return false;
  }
};

}  // namespace lightcuts::cuda
