#pragma once

#include <cstdint>

#include "kernels/shadow_map.h"
#include "kernels/surface.h"
#include "math/sample_stream.h"

namespace lightcuts {

// What a light's map looks at, which points it is drawn from, and how one thread draws a texel of a point's disc. The
// CPU's lanes draw a register of texels at once, from the same formulas of shadow_map.h.

// --- Views ---

/// Off the light's surface, so that its own plane lies behind it.
LC_KERNEL MapView vpl_map_view(Vec3 position, Vec3 axis, const Box& bounds) {
  return paraboloid_view(offset_point(position, axis), axis, bounds);
}

/// `which` 1: the second hemisphere.
LC_KERNEL MapView point_map_view(Vec3 position, Vec3 axis, const Box& bounds, int size, int which) {
  MapView view = paraboloid_view(position, axis, bounds);
  view.rim_sq = double_rim_sq(size);
  return which == 0 ? view : opposite(view);
}

/// A spot of less than a hemisphere has one map, any other point light two.
LC_FN int point_map_count(float cos_outer) { return cos_outer < 0 ? 2 : 1; }

// --- Points ---

/// A light's random word. Kinds: 0 VPLs, 1 point lights, 2 directional ones; `light` counts within its kind.
LC_FN std::uint32_t map_stream(std::uint32_t light, std::uint32_t kind, std::uint32_t seed) {
  return combine_bits(combine_bits(light, kind), seed);
}
LC_KERNEL std::uint32_t map_seed(std::uint64_t seed) { return static_cast<std::uint32_t>(derive_seed(seed, 0x6d6170)); }

/// Where in the order of `all` points the block of a map begins.
LC_FN std::uint32_t block_start(std::uint32_t stream, std::uint32_t all) {
  return static_cast<std::uint32_t>((std::uint64_t{stream} * all) >> 32);
}

/// True where the study's noise gives a point to a map; `share` of the points should have it.
LC_FN bool noise_chooses(std::uint32_t point, std::uint32_t stream, double share) {
  return static_cast<double>(combine_bits(point, stream)) * 0x1p-32 < share;
}

// --- One point ---

/// A point's disc as a map sees it.
struct ProjectedDisc {
  MapDisc<float> disc;       ///< paraboloid
  Vec3 local, normal;        ///< in the view's coordinates
  float plane;               ///< offset of the disc's plane along its normal [m]
  TexelRange columns, rows;  ///< what it may cover

  [[nodiscard]] LC_FN bool empty() const { return columns.lo > columns.hi || rows.lo > rows.hi; }
  [[nodiscard]] LC_FN int width() const { return columns.hi - columns.lo + 1; }
  [[nodiscard]] LC_FN int texels() const { return empty() ? 0 : width() * (rows.hi - rows.lo + 1); }
};

/// True where the map draws a point at `local` at all.
/// @param largest  radius of a whole disc [m]
template <bool Paraboloid>
LC_KERNEL bool map_sees(const MapView& view, Vec3 local, float largest) {
  if constexpr (!Paraboloid) return local.z > 0;
  // Where texels beyond the rim are drawn (point lights), discs of points beyond it serve them.
  if (view.rim_sq > 1) return local.z > -largest;
  // Discs reach a little higher than their points; a point below the horizon is left out as a whole.
  return local.z > 0 && local.z * local.z > kLeastCosine * kLeastCosine * dot(local, local);
}

/// The disc of a point that the map sees.
/// @param radius  of this disc [m]
/// @param sink    see pack_sink
template <bool Paraboloid>
LC_KERNEL ProjectedDisc project_disc(const MapView& view, Vec3 local, Vec3 normal, float radius, float sink, int size) {
  ProjectedDisc disc;
  disc.normal = to_local_vector(view.frame, normal);
  disc.plane = dot(local, disc.normal);
  const float deeper = disc.plane < 0 ? sink_in_front(sink) : sink_behind(sink);
  local = local + disc.normal * deeper;
  disc.plane = disc.plane + deeper;
  disc.local = local;
  const float half = 0.5f * static_cast<float>(size), distance_sq = dot(local, local);
  if (Paraboloid && distance_sq > (radius / kSmallDisc) * (radius / kSmallDisc) && local.z > 0) {
    const MapBox<float> box = paraboloid_box(local, disc.normal, square_root(distance_sq), radius);
    disc.columns = texel_range((box.u + 1.0f) * half, box.half_u * half, size);
    disc.rows = texel_range((box.v + 1.0f) * half, box.half_v * half, size);
  } else {
    const Footprint<float> print =
        Paraboloid ? paraboloid_footprint(local, radius) : orthographic_footprint(local, radius, view.half_width);
    disc.columns = texel_range((print.u + 1.0f) * half, print.radius * half, size);
    disc.rows = texel_range((print.v + 1.0f) * half, print.radius * half, size);
  }
  if constexpr (Paraboloid) {
    disc.disc = map_disc(local, disc.normal, disc.plane, radius * radius);
    if (!(disc.plane * disc.plane > kLeastPlane * kLeastPlane * distance_sq)) disc.rows = {0, -1};
  }
  return disc;
}

/// Depth at which the ray through the map's place (u, v) meets the disc [m]; infinite where it does not.
/// @param edges  of a cut disc, or null
template <bool Paraboloid>
LC_KERNEL float disc_depth(const MapView& view, const ProjectedDisc& disc, float radius_sq, const LocalEdges* edges,
                           float u, float v) {
  if constexpr (Paraboloid) {
    if (!(u * u + v * v < view.rim_sq)) return kInfinity;
    const TexelRay<float> w = texel_ray(u, u * u, v, v * v);
    const DiscTest<float> test = test_disc(disc.disc, w);
    if (!(test.nearness > 0) || !(test.outside < 0)) return kInfinity;
    if (edges != nullptr) {
      for (int e = 0; e < kDiscEdges; ++e) {
        if (!(along(w, edges->inward[e]) > edges->offset[e] * test.nearness)) return kInfinity;
      }
    }
    return depth_of_nearness(test.nearness, w.length);
  } else {
    const Vec3 hit = meet_plane_orthographic(u, v, disc.normal, disc.plane, view.half_width);
    if (!(hit.z > 0) || !(length_sq(hit - disc.local) < radius_sq)) return kInfinity;
    if (edges != nullptr) {
      for (int e = 0; e < kDiscEdges; ++e) {
        if (!(dot(edges->inward[e], hit) > edges->offset[e])) return kInfinity;
      }
    }
    return hit.z;
  }
}

}  // namespace lightcuts
