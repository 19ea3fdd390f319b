#pragma once

#include "cuda/flat_group.cuh"

// Pixels of some tiles, sorted by the planes that they lie in.

namespace lightcuts::cuda {

/// Pixels of `Each` tiles, a word of lanes for each.
template <int Each>
struct PixelSet {
  unsigned lanes[Each];
  [[nodiscard]] __device__ bool empty() const {
    unsigned any = 0;
#pragma unroll
    for (int k = 0; k < Each; ++k) any |= lanes[k];
    return any == 0;
  }
  [[nodiscard]] __device__ bool has(int k, std::uint32_t lane) const { return (lanes[k] >> lane & 1u) != 0; }
  __device__ void remove(const PixelSet& others) {
#pragma unroll
    for (int k = 0; k < Each; ++k) lanes[k] &= ~others.lanes[k];
  }
};

/// All of the pixels if they lie in a plane, else those in the plane of the first of them.
template <int Each>
__device__ inline PixelSet<Each> in_first_plane(const PixelSet<Each>& pixels, const Vec3 (&position)[Each],
                                                const Vec3 (&ng)[Each]) {
  if (flat_receivers<Each>(pixels.lanes, position, ng).reach < kInfinity) return pixels;
  Vec3 first, normal;
#pragma unroll
  for (int k = Each - 1; k >= 0; --k) {
    if (pixels.lanes[k] == 0) continue;
    const int leader = __ffs(static_cast<int>(pixels.lanes[k])) - 1;
    first = from_lane(position[k], leader), normal = from_lane(ng[k], leader);
  }
  PixelSet<Each> in;
#pragma unroll
  for (int k = 0; k < Each; ++k) {
    const Vec3 way = position[k] - first, turned = ng[k] - normal;
    const float slack = 1e-4f * length(way) + 1e-6f * max_component(max_of(first, -first));
    const bool near = dot(turned, turned) < 1e-10f && fabsf(dot(way, normal)) <= slack;
    in.lanes[k] = pixels.lanes[k] & __ballot_sync(kAllLanes, near);
  }
  return in;
}

/// Whether the pixels lie in a few planes; then those of each have a turn of their own.
template <int Each>
__device__ inline bool in_few_planes(PixelSet<Each> pixels, const Vec3 (&position)[Each], const Vec3 (&ng)[Each]) {
  constexpr int kMostPlanes = 4;
  for (int plane = 0; plane < kMostPlanes && !pixels.empty(); ++plane) {
    const PixelSet<Each> in = in_first_plane<Each>(pixels, position, ng);
    if (!(flat_receivers<Each>(in.lanes, position, ng).reach < kInfinity)) return false;
    pixels.remove(in);
  }
  return pixels.empty();
}

}  // namespace lightcuts::cuda
