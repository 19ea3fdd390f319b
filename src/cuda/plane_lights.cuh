#pragma once

#include "cuda/flat_group.cuh"
#include "kernels/group_lookup.h"

// VPLs whose light one look at their map has found to arrive at all pixels of a plane, or of which a pixel's place tells the
// share. In coordinates of the plane they take few operations: a pixel is two numbers, and so is a light but for its height.

namespace lightcuts::cuda {

/// A VPL and its map as the loops read them, 16 bytes at a time; the axis is the map's.
struct alignas(16) LitVpl {
  Vec3 position;
  std::uint32_t slot;  ///< of its map, kNone: all of its light arrives
  Vec3 z;
  float steps;  ///< as MapRecord
  Vec3 x;
  float bias_steps;
  Vec3 y;
  float unused;
  Vec3 intensity;
  float padding;
};

/// A pixel as loops read it; the normals are negated, towards the way that light comes.
struct LitPixel {
  Vec3 position, ns, ng;
};

/// A pixel's sums of a block of lights, in single precision.
struct PixelSum {
  Vec3 light{};
  float lost = 0;  ///< luminance that the clamp took
};

/// Pixels of a warp that lie in a plane, with coordinates in it.
struct WarpPlane {
  FlatReceivers pixels;  ///< with the normal turned away from the lit side
  Vec3 across, up;       ///< unit, at right angles
  float slack;           ///< lights nearer to the plane than this are on neither side for certain [m]
  float least_along;     ///< lights must be so far from the plane for its pixels to be in it up to rounding [m]
  float near_sq;         ///< lights nearer to the middle may be clamped at some pixel [m^2]
};

/// A pixel in its warp's plane: its place from the middle, and its shading normal along the plane's axes.
struct PlanePixel {
  float s = 0, t = 0;
  Vec3 ns;
};

__device__ inline WarpPlane plane_of(const FlatReceivers& pixels, float min_distance) {
  /// Fourth powers of smaller distances vanish [m].
  constexpr float kCarefulDistance = 1e-6f;
  WarpPlane plane;
  plane.pixels = pixels;
  plane.across = within_plane(pixels.half_a, pixels.ng);
  plane.up = cross(pixels.ng, plane.across);
  plane.slack = 2 * kFlatness * pixels.reach + 1e-6f * length(pixels.middle);
  plane.least_along = fmaxf(plane.slack, 1e4f * pixels.off);
  const float near = pixels.reach + fmaxf(min_distance, kCarefulDistance);
  plane.near_sq = 1.001f * near * near;
  return plane;
}

__device__ inline PlanePixel in_plane(const WarpPlane& plane, const LitPixel& pixel) {
  const Vec3 from = pixel.position - plane.pixels.middle;
  return {dot(from, plane.across),
          dot(from, plane.up),
          {dot(pixel.ns, plane.across), dot(pixel.ns, plane.up), dot(pixel.ns, plane.pixels.ng)}};
}

/// A light of which all arrives at all pixels of a warp, in coordinates of their plane.
///
/// At a pixel (s, t) it has a cosine of (cosine + s cosine_across + t cosine_up) / distance. Where shading normals are the
/// plane's, `height` is squared and the intensity has it for a factor.
struct alignas(16) PlainVpl {
  float across, up, height;  ///< of the light [m]
  float cosine, cosine_across, cosine_up;
  float red, green, blue;
};

/// A light of which each pixel's place on the map tells its share.
struct alignas(16) PlacedVpl : PlainVpl {
  float x, x_across, x_up;  ///< of the ray to a pixel along the map's axes, in half a map's texels
  float first_x;            ///< the map's middle, in texels from the own texel's, or from the word's first
  float y, y_across, y_up;
  float first_y;
  OneTexelShare share;  ///< if all pixels have the same texel for their own
  std::uint32_t texels;
};

__device__ inline float positive(float v) { return fmaxf(v, 0.0f); }

/// A light as the loops over pixels of a plane read it.
template <bool flat>
__device__ inline PlainVpl seen_from_plane(const WarpPlane& plane, const LitVpl& lit) {
  const Vec3 way = plane.pixels.middle - lit.position;
  const float height = dot(way, plane.pixels.ng), gain = flat ? height : 1.0f;
  PlainVpl plain;
  plain.across = -dot(way, plane.across);
  plain.up = -dot(way, plane.up);
  plain.height = flat ? height * height : height;
  plain.cosine = dot(lit.z, way);
  plain.cosine_across = dot(lit.z, plane.across);
  plain.cosine_up = dot(lit.z, plane.up);
  plain.red = lit.intensity.x * gain;
  plain.green = lit.intensity.y * gain;
  plain.blue = lit.intensity.z * gain;
  return plain;
}

template <bool flat>
__device__ inline PlacedVpl placed_on_map(const WarpPlane& plane, const LitVpl& lit, const GroupLook& look, int size) {
  const Vec3 way = plane.pixels.middle - lit.position;
  const float half = 0.5f * static_cast<float>(size);
  const bool one = __popc(look.own) == 1;
  const std::uint32_t own = one ? static_cast<std::uint32_t>(__ffs(static_cast<int>(look.own))) - 1 : 0;
  PlacedVpl placed;
  static_cast<PlainVpl&>(placed) = seen_from_plane<flat>(plane, lit);
  placed.x = half * dot(lit.x, way);
  placed.x_across = half * dot(lit.x, plane.across);
  placed.x_up = half * dot(lit.x, plane.up);
  placed.first_x = half - 0.5f - static_cast<float>(group_column(look.texels) + own % 3);
  placed.y = half * dot(lit.y, way);
  placed.y_across = half * dot(lit.y, plane.across);
  placed.y_up = half * dot(lit.y, plane.up);
  placed.first_y = half - 0.5f - static_cast<float>(group_row(look.texels) + own / 3);
  placed.share = share_of_one_texel(look.texels, own);
  placed.texels = look.texels;
  return placed;
}

/// The way from a light to a pixel, in the coordinates of its plane.
struct PlaneWay {
  float dx, dy;
  float distance_sq;
  float cos_light;  ///< times the distance
};
template <bool flat>
__device__ inline PlaneWay way_to(const PlanePixel& pixel, const PlainVpl& light) {
  const float dx = pixel.s - light.across, dy = pixel.t - light.up;
  const float height_sq = flat ? light.height : light.height * light.height;
  return {dx, dy, dx * dx + (dy * dy + height_sq),
          pixel.s * light.cosine_across + (pixel.t * light.cosine_up + light.cosine)};
}

/// What a pixel gets of a light before anything hides it, from the squared distance on.
template <bool flat>
__device__ inline float plane_cosines(const PlanePixel& pixel, const PlainVpl& light, const PlaneWay& way) {
  if constexpr (flat) return way.cos_light;
  return way.cos_light * positive(way.dx * pixel.ns.x + way.dy * pixel.ns.y + light.height * pixel.ns.z);
}

__device__ inline void add_light(const PlainVpl& light, float factor, PixelSum& sum) {
  sum.light.x = fmaf(light.red, factor, sum.light.x);
  sum.light.y = fmaf(light.green, factor, sum.light.y);
  sum.light.z = fmaf(light.blue, factor, sum.light.z);
}

/// Lights of which all arrives at all pixels of a warp: what is known of them leaves little to do.
template <bool flat, int Each>
__device__ inline void add_plain(const PlanePixel (&pixels)[Each], const PlainVpl* lights, int count,
                                 PixelSum (&sums)[Each]) {
#pragma unroll 2
  for (int i = 0; i < count; ++i) {
    const PlainVpl light = lights[i];
#pragma unroll
    for (int k = 0; k < Each; ++k) {
      const PlanePixel& pixel = pixels[k];
      const PlaneWay way = way_to<flat>(pixel, light);
      add_light(light,
                plane_cosines<flat>(pixel, light, way) *
                    lightcuts::detail::quick_reciprocal(way.distance_sq * way.distance_sq),
                sums[k]);
    }
  }
}

/// Lights of which each pixel's place tells its share. `one`: all pixels have the same texel for their own.
template <bool flat, bool one, int Each>
__device__ inline void add_placed(const PlanePixel (&pixels)[Each], const PlacedVpl* lights, int count,
                                  PixelSum (&sums)[Each]) {
#pragma unroll 1
  for (int i = 0; i < count; ++i) {
    const PlacedVpl& light = lights[i];
#pragma unroll
    for (int k = 0; k < Each; ++k) {
      const PlanePixel& pixel = pixels[k];
      const PlaneWay way = way_to<flat>(pixel, light);
      const float inverse = lightcuts::detail::quick_inverse_root(way.distance_sq), inverse_sq = inverse * inverse;
      const float scale = lightcuts::detail::quick_reciprocal(way.distance_sq * inverse + way.cos_light);
      const float x = (pixel.s * light.x_across + (pixel.t * light.x_up + light.x)) * scale + light.first_x;
      const float y = (pixel.s * light.y_across + (pixel.t * light.y_up + light.y)) * scale + light.first_y;
      const OneTexelShare& of = light.share;
      const float share =
          one ? (of.at_centre + of.x_slope * x + of.x_bend * fabsf(x)) + (of.y_slope * y + of.y_bend * fabsf(y))
              : share_by_place(light.texels, x, y);
      const float factor = plane_cosines<flat>(pixel, light, way) * (inverse_sq * inverse_sq) * share;
      add_light(light, factor, sums[k]);
    }
  }
}

}  // namespace lightcuts::cuda
