#pragma once

#include "cuda/flat_group.cuh"
#include "cuda/light_maps.h"
#include "cuda/see.cuh"

namespace lightcuts::cuda {

/// Imperfect shadow maps, as far as there are any: a light whose map is missing is marked as wanted.
///
/// @tparam Size  of maps, 0: as they say
template <class Depth, int Size>
struct SeeByMaps {
  static constexpr bool shadows = true, own_cuts = false, traces = false, by_maps = true, asks = false;
  static constexpr int look_tests = 3;
  static constexpr int place_tests = 5;      ///< more where pixels look by their places
  static constexpr int own_look_tests = 16;  ///< yet more where they look at all of the map
  static constexpr int crew_look_tests = 6, most_umbras = 16;
  static constexpr float first_caution = 0.9f, least_occluder = kLeastOccluderByMaps;
  using Group = FlatReceivers;
  struct Staged {
    std::uint32_t slot;
    std::uint32_t row;  ///< of the table; of a light with a map what the group's look said, see look_up_group_texels
    float share;        ///< of all pixels of the group, or kEachItsOwn
  };
  MapSetView maps;
  WantedMaps wanted;
  ShareTable table = {};

  __device__ static Group group(unsigned lanes, Vec3 position, Vec3 ng) { return flat_receivers(lanes, position, ng); }

  /// False where the light's map is missing: then a share of `guess` is taken to arrive.
  template <int kind>
  __device__ bool stage(std::uint32_t light, float guess, Staged& staged) const {
    staged.slot = slot_of<kind>(light);
    staged.row = kGroupUnsure;
    staged.share = kEachItsOwn;
    if (staged.slot != kNone) return true;
    staged.row = table.row(kind, light);
    if (staged.row != kNone) return true;
    wanted.mark(kind, light);
    staged.share = guess;
    return false;
  }

  /// Whether each pixel looks at the map, and not only at what the group's look said.
  __device__ static bool looks_at_all(const Staged& staged) { return staged.row == kGroupUnsure; }

  template <int kind>
  __device__ void ask(std::uint32_t light) const {
    if (slot_of<kind>(light) == kNone && table.row(kind, light) == kNone) wanted.mark(kind, light);
  }

  /// Looks at a light for all pixels of a group at once, where that can be done.
  template <int kind>
  __device__ void look(const Group& group, Staged& staged) const {
    if (kind != vpl_kind || staged.slot == kNone) return;
    const MapRecord map = maps.records[staged.slot];
    const std::uint32_t texels = look_up_group_texels<Depth, Size>(map, group, maps.size, codes_of(staged.slot));
    staged.row = texels;
    staged.share = texels == kGroupTexels ? 1 : texels == 0 ? 0 : kEachItsOwn;
  }

  template <int kind>
  __device__ float share(const Receiver<FastFloat>& receiver, Vec3 from, int pixel, const StagedLight& light,
                         const Staged& staged) const {
    if (staged.share >= 0) return staged.share;
    if (staged.slot == kNone) return table.share(staged.row, static_cast<std::uint32_t>(pixel));
    const Vec3 ng{receiver.ng.x.value, receiver.ng.y.value, receiver.ng.z.value};
    const MapRecord map = maps.records[staged.slot];
    if (kind == vpl_kind && staged.row != kGroupUnsure) {
      const Vec3 local = to_map(map, from);
      return share_by_place<Size>(staged.row, local, dot(local, local), maps.size);
    }
    if (kind == point_kind && light.cos_outer < 0 && dot(from - map.origin, map.z) < 0) {
      return look_up<true>(staged.slot + 1, maps.records[staged.slot + 1], from, ng);
    }
    if constexpr (kind == vpl_kind) {  // the receiver faces it, or there were nothing to ask
      const Vec3 local = to_map(map, from), normal{-dot(ng, map.x), -dot(ng, map.y), -dot(ng, map.z)};
      return look_up_facing<Depth, Size>(map, local, normal, dot(local, local), dot(local, normal), maps.size,
                                         codes_of(staged.slot));
    }
    return look_up<kind != directional_kind>(staged.slot, map, from, ng);
  }

 private:
  template <int kind>
  __device__ std::uint32_t slot_of(std::uint32_t light) const {
    return (kind == vpl_kind ? maps.vpl_slots : kind == point_kind ? maps.point_slots : maps.directional_slots)[light];
  }
  __device__ const Depth* codes_of(std::uint32_t slot) const {
    const int size = Size > 0 ? Size : maps.size;
    return static_cast<const Depth*>(maps.codes) + static_cast<std::size_t>(slot) * (size * size);
  }
  template <bool paraboloid>
  __device__ float look_up(std::uint32_t slot, const MapRecord& map, Vec3 from, Vec3 ng) const {
    return look_up_map<Depth, paraboloid, Size>(map, to_map(map, from), ng, maps.size, codes_of(slot));
  }
};

/// Walks with these look at nothing but the upper levels' lights: they only ask for maps.
template <class Depth>
struct AskForMaps : SeeByMaps<Depth, 0> {
  static constexpr bool asks = true;
  static constexpr float first_caution = 0.8f;
};

}  // namespace lightcuts::cuda
