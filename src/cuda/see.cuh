#pragma once

#include "cuda/fast_float.cuh"
#include "cuda/remembered_rays.cuh"
#include "cuda/staged_light.cuh"
#include "cuda/tracer.cuh"
#include "kernels/light.h"
#include "kernels/offset_point.h"

namespace lightcuts::cuda {

/// The geometric factor of a staged light at a pixel, without visibility.
struct LightFactor {
  float clamped, unclamped;
};
template <int kind>
__device__ inline LightFactor factor_of(const Receiver<FastFloat>& receiver, const StagedLight& light,
                                        float min_distance_sq) {
  if constexpr (kind == vpl_kind) {
    const VplFactor<FastFloat> f =
        vpl_factor(receiver, fast(light.position), fast(light.axis), FastFloat(min_distance_sq));
    return {f.clamped.value, f.unclamped.value};
  } else if constexpr (kind == point_kind) {
    const float f = point_factor(receiver, Spot<FastFloat>{fast(light.position), fast(light.axis),
                                                           FastFloat(light.cos_outer), FastFloat(light.inverse_range)})
                        .value;
    return {f, f};
  } else {
    const float f = directional_factor(receiver, fast(light.axis)).value;
    return {f, f};
  }
}

/// Where the shadow ray to a staged light goes.
template <int kind>
__device__ inline Ray shadow_ray_to(Vec3 from, const StagedLight& light) {
  if constexpr (kind == vpl_kind) {
    return {from, 0, offset_point(light.position, light.axis) - from, kShadowRayEnd};
  } else if constexpr (kind == point_kind) {
    return {from, 0, light.position - from, kShadowRayEnd};
  } else {
    return {from, 0, -light.axis, kInfinity};
  }
}

// --- Ways to see lights ---
//
// `shadows`: looking at a light costs more than its bound. `own_cuts`: so much more that every pixel of a group tests
// the nodes that the group as a whole refuses. `traces`: looks are counted as rays. `by_maps`: lights may have no maps
// yet. `asks`: walks once, to mark lights whose maps are missing. `look_tests`: tests of nodes that take a warp as long
// as a look; `crew_look_tests`: the same for a crew, where every look counts alike; `most_umbras`: of a group, each of
// which costs every test; `least_occluder`: what a polygon must weigh (see occluder_weight) to be worth that;
// `first_caution`: the first walk's threshold relative to the estimate. All by measurement: where a walk costs little,
// or its rays are remembered, few nodes first tell the total better, for no node leaves a cut again. `Group`: what is
// known of a group's pixels. `Staged`: what is read, and seen, of a light once for all of them.
//
// share() says what arrives at a pixel: at `receiver`, whose exact position is `from`, the tile's `pixel`-th. Where
// rays are traced only `from` counts.

/// All light arrives.
struct SeeAll {
  static constexpr bool shadows = false, own_cuts = false, traces = false, by_maps = false, asks = false;
  static constexpr int look_tests = 0, crew_look_tests = 0, most_umbras = 0;
  static constexpr float first_caution = 4, least_occluder = 0;
  struct Group {};
  struct Staged {
    static constexpr float share = 1;
  };
  __device__ static Group group(unsigned, Vec3, Vec3) { return {}; }
  template <int kind>
  __device__ bool stage(std::uint32_t, float, Staged&) const {
    return true;
  }
  template <int kind>
  __device__ void look(const Group&, Staged&) const {}
  template <int kind>
  __device__ float share(const Receiver<FastFloat>&, Vec3, int, const StagedLight&, const Staged&) const {
    return 1;
  }
};

/// Whether something is in a ray's way; compiled once, for wherever rays are traced the loops around them are to stay
/// in the instruction cache.
__device__ __noinline__ inline bool blocked(const DeviceTracer& tracer, const Ray& ray) { return tracer.occluded(ray); }

/// Exact shadow rays.
struct SeeByRays {
  static constexpr bool shadows = true, own_cuts = true, traces = true, by_maps = false, asks = false;
  static constexpr int look_tests = 1, crew_look_tests = 1, most_umbras = 32;
  static constexpr float first_caution = 16, least_occluder = 0;
  struct Group {};
  struct Staged {
    static constexpr float share = -1;
    unsigned asks, sees;   ///< pixels that trace a ray to the light, and those that it reaches
    std::uint32_t before;  ///< rays to the lights before it
  };
  DeviceTracer tracer;
  RayMemory memory = {};
  __device__ static Group group(unsigned, Vec3, Vec3) { return {}; }
  template <int kind>
  __device__ bool stage(std::uint32_t, float, Staged&) const {
    return true;
  }
  template <int kind>
  __device__ void look(const Group&, Staged&) const {}
  template <int kind>
  __device__ float share(const Receiver<FastFloat>&, Vec3 from, int, const StagedLight& light, const Staged&) const {
    return blocked(tracer, shadow_ray_to<kind>(from, light)) ? 0.0f : 1.0f;
  }
};

/// The memory for rays of warp `i` and of a crew's block `i`. Crews start when no warp is at work any more.
template <class Visibility>
__device__ RememberedRays memory_of_warp(const Visibility&, std::uint32_t) {
  return {};
}
template <class Visibility>
__device__ RememberedRays memory_of_block(const Visibility&, std::uint32_t) {
  return {};
}
__device__ inline RememberedRays memory_of_warp(const SeeByRays& see, std::uint32_t i) {
  return {see.memory, std::size_t{i} * RayMemory::kOfWarp, RayMemory::kOfWarp};
}
__device__ inline RememberedRays memory_of_block(const SeeByRays& see, std::uint32_t i) {
  return {see.memory, std::size_t{i} * RayMemory::kOfBlock, RayMemory::kOfBlock};
}

}  // namespace lightcuts::cuda
