#pragma once

#include "cuda/packet_cut.h"
#include "cuda/warp.cuh"
#include "kernels/occluder.h"

namespace lightcuts::cuda {

/// The umbras of the occluders that cover most of a group's sky, in the memory that a warp shares: what lies in one of them
/// is in the cut, but gives nothing and needs no look.
template <bool wanted>
struct Umbras {
  static constexpr int kMost = 32;

  Umbra umbra[kMost];
  int count;

  /// By all lanes together: each has one of the umbras to find, of the best occluder among every 32nd.
  __device__ void find(const CutJob& job, const Box& receivers, int lane) {
    Box lights;
    if (job.trees.kind[vpl_kind].leaf_count > 0) lights = extend(lights, job.trees.kind[vpl_kind].nodes[0].box);
    if (job.trees.kind[point_kind].leaf_count > 0) lights = extend(lights, job.trees.kind[point_kind].nodes[0].box);
    const bool far_lights = job.trees.kind[directional_kind].leaf_count > 0;
    const OccluderView view =
        occluder_view(job.occluders, job.occluder_count, extend(job.scene_bounds, extend(receivers, lights)));
    const Vec3 middle = center(receivers);
    float most = 0;
    std::uint32_t best = kNone;
    for (auto i = static_cast<std::uint32_t>(lane); i < view.count; i += 32) {
      if (!far_lights && !is_between(view.occluders[i], receivers, lights, view.gap)) continue;
      const float weight = occluder_weight(view.occluders[i], middle);
      if (!(weight > most)) continue;
      most = weight;
      best = i;
    }
    Umbra own;
    const bool found = best != kNone && find_umbra(view.occluders[best], receivers, view.rounding, view.gap, own) &&
                       (far_lights || touches_box(own, lights));
    const unsigned finds = __ballot_sync(kAllLanes, found);
    __syncwarp();
    if (found) umbra[__popc(finds & ((1u << lane) - 1))] = own;
    if (lane == 0) count = __popc(finds);
    __syncwarp();
  }

  template <int kind>
  __device__ bool hide(const Box& box) const {
    for (int i = 0; i < count; ++i) {
      if (kind == directional_kind ? hides_directions(umbra[i], box) : hides_box(umbra[i], box)) return true;
    }
    return false;
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
