#pragma once

#include "cuda/light_maps.h"
#include "cuda/see.cuh"
#include "kernels/map_lookup.h"

namespace lightcuts::cuda {

/// Imperfect shadow maps, as far as there are any: a light whose map is missing is marked as wanted and counts as if all
/// of it arrived.
///
/// @tparam Size  of maps, 0: as they say
template <class Depth, int Size>
struct SeeByMaps {
  static constexpr bool shadows = true, own_cuts = false, traces = false;
  struct alignas(16) Staged {
    MapRecord map;
    std::uint32_t slot, row;
  };
  MapSetView maps;
  WantedMaps wanted;
  ShareTable table = {};

  /// False where the light's map is missing.
  template <int kind>
  __device__ bool stage(std::uint32_t light, Staged& staged) const {
    staged.slot = slot_of<kind>(light);
    if (staged.slot == kNone) {
      staged.row = table.row(kind, light);
      if (staged.row == kNone) wanted.mark(kind, light);
      return staged.row != kNone;
    }
    staged.map = maps.records[staged.slot];
    return true;
  }

  /// Asks for the texels that a place will look at, ahead of time; pixels near it look at about the same ones.
  template <int kind>
  __device__ void prefetch(const Staged& staged, Vec3 from) const {
    if (kind == directional_kind || staged.slot == kNone) return;
    const int size = Size > 0 ? Size : maps.size;
    const Vec3 local = to_map(staged.map, from);
    const float half = 0.5f * static_cast<float>(size);
    const float scale = half / fmaxf(sqrtf(dot(local, local)) + local.z, 1e-30f);
    const auto texel = [&](float at) { return min_of(max_of(static_cast<int>(at * scale + half), 1), size - 2); };
    const int x = texel(local.x), y = texel(local.y);
    const Depth* const codes =
        static_cast<const Depth*>(maps.codes) + static_cast<std::size_t>(staged.slot) * (size * size);
    for (int row = y - 1; row <= y + 1; ++row) {
      asm volatile("prefetch.global.L2 [%0];" ::"l"(codes + row * size + x));
    }
  }

  template <int kind>
  __device__ float share(const Receiver<FastFloat>& receiver, Vec3 from, const StagedLight& light,
                         const Staged& staged) const {
    if (staged.slot == kNone) return staged.row == kNone ? 1.0f : table.share(staged.row, threadIdx.x % 32);
    const Vec3 ng{receiver.ng.x.value, receiver.ng.y.value, receiver.ng.z.value};
    if (kind == point_kind && light.cos_outer < 0 && dot(from - staged.map.origin, staged.map.z) < 0) {
      return look_up<true>(staged.slot + 1, maps.records[staged.slot + 1], from, ng);
    }
    return look_up<kind != directional_kind>(staged.slot, staged.map, from, ng);
  }

 private:
  template <int kind>
  __device__ std::uint32_t slot_of(std::uint32_t light) const {
    return (kind == vpl_kind ? maps.vpl_slots : kind == point_kind ? maps.point_slots : maps.directional_slots)[light];
  }
  template <bool paraboloid>
  __device__ float look_up(std::uint32_t slot, const MapRecord& map, Vec3 from, Vec3 ng) const {
    const int size = Size > 0 ? Size : maps.size;
    const Depth* const codes = static_cast<const Depth*>(maps.codes) + static_cast<std::size_t>(slot) * (size * size);
    return look_up_map<Depth, paraboloid, Size>(map, to_map(map, from), ng, size, codes);
  }
};

}  // namespace lightcuts::cuda
