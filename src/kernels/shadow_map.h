#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/bits.h"
#include "kernels/light.h"
#include "lightcuts/math.h"
#include "math/frame.h"

namespace lightcuts {

// Imperfect shadow maps: small pictures of distances as a light sees them, drawn from points of surfaces. The number
// type T is `float`, or a register of SIMD lanes that brings its own operations (see kernels/light.h).
// Sources: Ritschel et al. 2008; paraboloid projection: Brabec et al. 2002; reference 02-algorithms, section 4.

// --- Depth codes ---

/// The code that says "nothing was drawn here".
template <class Depth>
inline constexpr Depth kNoDepth = static_cast<Depth>(~Depth{0});

/// The largest code of a distance: a share of the map's `far`. 32-bit codes have the 24 bits that a float has.
template <class Depth>
inline constexpr float kDepthSteps = sizeof(Depth) == 2 ? 65534.0f : 16777214.0f;

template <class Depth>
LC_FN Depth encode_depth(float distance, float steps_per_metre) {
  return static_cast<Depth>(clamp_to(distance * steps_per_metre + 0.5f, 0.0f, kDepthSteps<Depth>));
}

// --- Views ---

/// How a map looks at the world: from `origin`, z along the light.
///
/// A paraboloid (`half_width` 0) sees the hemisphere around z: direction w falls on (w.x, w.y) / (1 + w.z), which is the
/// unit disc, and a depth is the distance from the origin. An orthographic view (directional lights) sees the square
/// of 2 half_width [m], and a depth is the distance from the plane z = 0. Either way the map is the square [-1, 1]^2.
struct MapView {
  Vec3 origin;  ///< [m]
  Frame frame;
  float half_width = 0;  ///< [m]
  float rim_sq = 1;      ///< texels whose centre lies beyond this squared radius stay empty
  float far = 0;         ///< no surface is farther [m]
};

/// Where a map sees a point.
template <class T>
struct MapPoint {
  T u, v;   ///< within [-1, 1]
  T depth;  ///< [m]
};

template <class T>
LC_FN Vec3T<T> broadcast_to(Vec3 v) {
  return {T(v.x), T(v.y), T(v.z)};
}
template <class T>
LC_FN Vec3T<T> to_local_vector(const Frame& f, Vec3T<T> v) {
  return {dot(v, broadcast_to<T>(f.x)), dot(v, broadcast_to<T>(f.y)), dot(v, broadcast_to<T>(f.z))};
}
template <class T>
LC_FN Vec3T<T> to_local_point(const MapView& view, Vec3T<T> p) {
  return to_local_vector(view.frame, p - broadcast_to<T>(view.origin));
}

/// Largest distance from a point to a place in the box [m].
LC_FN float farthest_distance(const Box& box, Vec3 p) {
  const Vec3 lo = p - box.lo, hi = box.hi - p;
  const Vec3 far = max_of(max_of(lo, -lo), max_of(hi, -hi));
  return std::sqrt(dot(far, far));
}

LC_FN MapView paraboloid_view(Vec3 origin, Vec3 axis, const Box& bounds) {
  return {origin, make_frame(axis), 0, 1, farthest_distance(bounds, origin)};
}

/// The hemisphere behind: the same map turned around its x axis.
LC_FN MapView opposite(MapView view) {
  view.frame.y = -view.frame.y;
  view.frame.z = -view.frame.z;
  return view;
}

/// Two hemispheres meet at the rim: texels that it cuts are drawn whole, and one beyond for lookups next to it.
LC_FN float double_rim_sq(int size) {
  const float rim = 1 + 4.0f / static_cast<float>(size);
  return rim * rim;
}

/// Sees the whole box along `direction`.
LC_FN MapView orthographic_view(Vec3 direction, const Box& bounds) {
  const float radius = max_of(0.5f * diagonal(bounds), 1e-30f);
  const Vec3 centre = is_empty(bounds) ? Vec3{} : center(bounds);
  return {centre - direction * radius, make_frame(direction), radius, 2, 2 * radius};
}

/// Paraboloid projection of a point in the view's coordinates. Source: reference equation 4.2.
template <class T>
LC_FN MapPoint<T> project_paraboloid(Vec3T<T> local) {
  const T distance = square_root(dot(local, local));
  const T scale = T(1.0f) / max_of(distance + local.z, T(1e-30f));
  return {local.x * scale, local.y * scale, distance};
}

template <class T>
LC_FN MapPoint<T> project_orthographic(Vec3T<T> local, float half_width) {
  const T scale(1.0f / half_width);
  return {local.x * scale, local.y * scale, local.z};
}

/// Unit direction of a point of the map's disc. Source: reference equation 4.3.
LC_FN Vec3 unproject_paraboloid(float u, float v) {
  const float rho_sq = u * u + v * v;
  const float scale = 1.0f / (1.0f + rho_sq);
  return {2 * u * scale, 2 * v * scale, (1 - rho_sq) * scale};
}

/// Coordinate of a texel's centre in [-1, 1].
LC_FN float texel_centre(int i, int size) { return (2 * static_cast<float>(i) + 1) / static_cast<float>(size) - 1; }

// --- Drawing ---

/// Directions nearer to the horizon than this cosine are not drawn: a plane through the light is no occluder for it.
inline constexpr float kLeastCosine = 1e-3f;

inline constexpr int kDiscEdges = 4;

/// The part of its surface that a point stands for: a disc, cut by some edges of the surface.
/// A place q of the plane belongs to it where dot(inward[i], q) >= offset[i]; unused edges have (0, -1).
struct DiscShape {
  float radius = 0;         ///< [m]
  Vec3 inward[kDiscEdges];  ///< unit
  float offset[kDiscEdges] = {-1, -1, -1, -1};
};

/// How far a disc is moved along its normal, so that it lies behind the surface that it stands for: where its light is on the
/// normal's side, and where it is behind [m]. Two numbers of 8 bits' precision in one word.
LC_FN float pack_sink(float in_front, float behind) {
  // To the nearest: half of the last place is added before the rest is cut off.
  const std::uint32_t front = bits_of(in_front) + 0x8000u, back = bits_of(behind) + 0x8000u;
  return float_of((front & 0xffff0000u) | back >> 16);
}
LC_FN float sink_in_front(float sink) { return float_of(bits_of(sink) & 0xffff0000u); }
LC_FN float sink_behind(float sink) { return float_of(bits_of(sink) << 16); }

/// A circle on the map that covers what a disc can cover, in [-1, 1] coordinates.
template <class T>
struct Footprint {
  T u, v, radius;
};

/// The sphere around a point bounds its disc whatever its normal, and a paraboloid maps the circle of directions
/// around a sphere to a circle exactly. Where the light lies within the sphere the footprint is the whole map.
template <class T>
LC_FN Footprint<T> paraboloid_footprint(Vec3T<T> local, float radius) {
  const T tangent_sq = dot(local, local) - T(radius * radius);
  const T reach = square_root(max_of(tangent_sq, T(0.0f))) + local.z;
  const T scale = T(1.0f) / max_of(reach, T(1e-30f));
  const auto whole = tangent_sq < T(0.0f);
  const T zero(0.0f);
  return {select(whole, zero, local.x * scale), select(whole, zero, local.y * scale),
          select(whole, T(2.0f), T(radius) * scale)};
}

template <class T>
LC_FN Footprint<T> orthographic_footprint(Vec3T<T> local, float radius, float half_width) {
  const T scale(1.0f / half_width);
  return {local.x * scale, local.y * scale, T(radius) * scale};
}

/// A box on the map that holds what a disc covers, as its middle and half its sides.
template <class T>
struct MapBox {
  T u, v, half_u, half_v;
};

/// Discs larger than this share of their distance have the footprint of their sphere, smaller ones a box of their own.
inline constexpr float kSmallDisc = 0.25f;

/// Smaller than the sphere's footprint where the disc is seen at a slant. For discs above the horizon whose radius is at most
/// kSmallDisc of their distance.
///
/// To first order the disc reaches radius * |part of the gradient of u or v in its plane|. The map keeps angles, so both
/// gradients are as long, 1 / (distance + z); u's direction is (1, 0, 0) - u (x, y, z + distance) / distance. The rest is
/// less than 1.25 times the squared angle r / (d - r), which bounds half the second derivative over the disc.
template <class T>
LC_FN MapBox<T> paraboloid_box(Vec3T<T> local, Vec3T<T> normal, T distance, T radius) {
  const T one(1.0f);
  const T inverse = reciprocal(max_of(distance, T(1e-30f)));
  const T scale = reciprocal(max_of(distance + local.z, T(1e-30f)));
  const T u = local.x * scale, v = local.y * scale;
  const T along = dot(local, normal) * inverse + normal.z;
  const T across_u = normal.x - u * along, across_v = normal.y - v * along;
  const T share = radius * inverse, angle = share * (one + T(1 / (1 - kSmallDisc)) * share);
  const T bend = T(1.25f) * angle * angle, reach = radius * scale;
  return {u, v, reach * square_root(max_of(one - across_u * across_u, T(0.0f))) + bend,
          reach * square_root(max_of(one - across_v * across_v, T(0.0f))) + bend};
}

/// The ray through a place of a paraboloid map, not of unit length: its direction is (2u, 2v, 1 - rho^2) and its length
/// 1 + rho^2.
template <class T>
struct TexelRay {
  T x, y, z, length;
};

/// @param u_sq, v_sq  squares of u and v, which whole columns and rows of texels share
template <class T>
LC_FN TexelRay<T> texel_ray(T u, T u_sq, T v, T v_sq) {
  return {u + u, v + v, (T(1.0f) - u_sq) - v_sq, (T(1.0f) + u_sq) + v_sq};
}
template <class T>
LC_FN T along(const TexelRay<T>& w, const Vec3T<T>& direction) {
  return (w.x * direction.x + w.y * direction.y) + w.z * direction.z;
}

/// A disc as the texels of a paraboloid map test it, in the view's coordinates.
///
/// A ray w meets its plane at w / s, s = dot(w, normal), and the disc where |w / s - centre| < radius, that is where
/// |w|^2 + s (slack s - dot(w, twice_centre)) < 0: no division a texel. s > 0 grows as the meeting point comes nearer,
/// and means the same for all discs at a texel, so the largest one wins: the map is drawn in s, the "nearness".
template <class T>
struct MapDisc {
  Vec3T<T> normal;        ///< divided by its dot product with the centre [1/m]
  Vec3T<T> twice_centre;  ///< [m]
  T slack;                ///< squared distance of the centre minus squared radius [m^2]
};

/// Planes that pass the light at less than this share of the disc's distance are seen edge-on: nothing of them is drawn.
inline constexpr float kLeastPlane = 1e-5f;

/// @param plane  dot(local, normal), not near 0
template <class T>
LC_FN MapDisc<T> map_disc(Vec3T<T> local, Vec3T<T> normal, T plane, T radius_sq) {
  return {normal * reciprocal(plane), local + local, dot(local, local) - radius_sq};
}

/// Whether a texel's ray meets the disc, and its nearness there (below 0: behind the light), as `inside ? s : ...`.
template <class T>
struct DiscTest {
  T nearness;
  T outside;  ///< below 0 inside the disc
};
template <class T>
LC_FN DiscTest<T> test_disc(const MapDisc<T>& disc, const TexelRay<T>& w) {
  const T s = along(w, disc.normal);
  return {s, w.length * w.length + s * (disc.slack * s - along(w, disc.twice_centre))};
}

/// An edge that cuts a disc, as a texel's ray tests it: the meeting point is on the disc's side where along(w, it) > 0.
/// @param inward  the edge's inward direction in the view's coordinates, `offset` its offset in them
template <class T>
LC_FN Vec3T<T> map_edge(const MapDisc<T>& disc, Vec3T<T> inward, T offset) {
  return inward - disc.normal * offset;
}

/// The depth at a texel of a paraboloid map whose nearness is not 0 [m].
template <class T>
LC_FN T depth_of_nearness(T nearness, T ray_length) {
  return ray_length / nearness;
}

/// Where the ray through an orthographic map's place meets the plane of a surface point: `plane` is the plane's offset
/// along its normal. Not a number where it does not. An orthographic map's nearness is far minus depth.
template <class T>
LC_FN Vec3T<T> meet_plane_orthographic(T u, T v, Vec3T<T> normal, T plane, T half_width) {
  const T x = u * half_width, y = v * half_width;
  return {x, y, (plane - x * normal.x - y * normal.y) / normal.z};
}

/// The half-planes of a shape, in a view's coordinates.
struct LocalEdges {
  Vec3 inward[kDiscEdges];
  float offset[kDiscEdges];
};

LC_FN LocalEdges to_local(const DiscShape& shape, const MapView& view) {
  LocalEdges edges{};
  for (int i = 0; i < kDiscEdges; ++i) {
    edges.inward[i] = to_local_vector(view.frame, shape.inward[i]);
    edges.offset[i] = shape.offset[i] - dot(shape.inward[i], view.origin);
  }
  return edges;
}

/// Texels whose centres lie within `radius` of `centre`: from `lo` to `hi`, both in [0, size).
struct TexelRange {
  int lo, hi;
};
LC_FN TexelRange texel_range(float centre, float radius, int size) {
  const float end = static_cast<float>(size);
  // Truncation of what is not negative is the floor; a range that ends before it begins is empty.
  const float lo = clamp_to<float>(centre - radius + 0.5f, 0, end),
              hi = clamp_to<float>(centre + radius + 0.5f, 0, end);
  return {static_cast<int>(lo), static_cast<int>(hi) - 1};
}

// --- Looking up ---

/// How far in front of the receiver an occluder must be to count, as a share of a texel's width at the receiver.
///
/// Each texel holds the depth of a surface at its own centre, and is compared with the receiver's plane there, so
/// slopes need no bias. What remains is rounding to a whole depth code, and curved or cornered surfaces, which differ
/// from the plane by a part of a texel's width. That width is small near the light, so contact shadows stay.
inline constexpr float kBiasTexels = 0.25f;

/// The same for the texels beside the receiver's own, where that one lets light pass: beside a corner or a small thing they
/// hold another surface, which stands a texel's width before the receiver's plane and shadows nothing.
inline constexpr float kBesideBiasTexels = 1;

/// What the five taps around a receiver are compared with: a tap at (u + du, v + dv) holds an occluder if its stored depth
/// plus `bias` is less than that of the receiver's plane there, or of the receiver where the plane lies farther.
template <class T>
struct TapPlane {
  MapPoint<T> at;
  T inverse;           ///< 1 / depth, of paraboloids
  T along_u, along_v;  ///< slope of 1 / depth (paraboloid) or of depth (orthographic)
  T bias;              ///< [m]
};

/// Cosines below this are taken for it: the slope of a plane seen edge-on has no bound.
inline constexpr float kLeastFacing = 1e-3f;

template <class T>
LC_FN T away_from_zero(T cosine) {
  return select(cosine < T(0.0f), min_of(cosine, T(-kLeastFacing)), max_of(cosine, T(kLeastFacing)));
}

/// @param texel  width of a texel in [-1, 1] coordinates: 2 / size
/// @param step   depth of one code [m]
///
/// For directions w(u, v), 1/t = dot(w, n) / dot(x, n) on the plane through x with normal n, so d(1/t)/du follows from
/// dw/du = h ((1, 0, 0) - h u (u, v, 1)), h = 2 / (1 + u^2 + v^2).
template <class T>
LC_FN TapPlane<T> tap_plane_paraboloid(Vec3T<T> local, Vec3T<T> normal, float texel, float step) {
  TapPlane<T> plane;
  plane.at = project_paraboloid(local);
  const T u = plane.at.u, v = plane.at.v, distance = max_of(plane.at.depth, T(1e-20f));
  plane.inverse = T(1.0f) / distance;
  const T h = T(2.0f) / (T(1.0f) + u * u + v * v);
  const T facing = away_from_zero(dot(local, normal) * plane.inverse);
  const T scale = h * plane.inverse / facing;
  const T along = h * (u * normal.x + v * normal.y + normal.z);
  plane.along_u = scale * (normal.x - u * along);
  plane.along_v = scale * (normal.y - v * along);
  plane.bias = T(step) + T(kBiasTexels * texel) * h * distance;
  return plane;
}

template <class T>
LC_FN TapPlane<T> tap_plane_orthographic(Vec3T<T> local, Vec3T<T> normal, float half_width, float texel, float step) {
  TapPlane<T> plane;
  plane.at = project_orthographic(local, half_width);
  plane.inverse = T(0.0f);
  const T scale = T(-half_width) / away_from_zero(normal.z);
  plane.along_u = scale * normal.x;
  plane.along_v = scale * normal.y;
  plane.bias = T(step + kBiasTexels * texel * half_width);
  return plane;
}

/// 1 where the tap at (u, v) lets light pass, else 0. `stored` is in metres.
template <class T>
LC_FN T tap_passes(const TapPlane<T>& plane, T u, T v, T stored, bool paraboloid) {
  const T change = plane.along_u * (u - plane.at.u) + plane.along_v * (v - plane.at.v);
  const T reach = stored + plane.bias;
  if (paraboloid) {
    return select(reach * (plane.inverse + max_of(change, T(0.0f))) < T(1.0f), T(0.0f), T(1.0f));
  }
  return select(reach < plane.at.depth + min_of(change, T(0.0f)), T(0.0f), T(1.0f));
}

/// The five taps: the receiver's texel and its four neighbours.
inline constexpr int kTaps = 5;
LC_FN int tap_x(int tap) { return tap == 1 ? 1 : tap == 2 ? -1 : 0; }
LC_FN int tap_y(int tap) { return tap == 3 ? 1 : tap == 4 ? -1 : 0; }

/// Share of light that arrives at a point: five lookups, a plus, of which the results are averaged, never the depths. Each counts
/// by the receiver's place between the centres of texels, as in linear interpolation: so two of them count nothing, and an
/// edge of a shadow is a texel wide.
///
/// @param local   receiver in the view's coordinates [m]
/// @param normal  its unit geometric normal in them
/// @param far     depth of the largest code [m]
/// @param fetch   fetch(x, y): the code of a texel; a texel where nothing was drawn lets light pass
/// Source: report section 3.4; the plus-shaped pattern: reference equation 4.6.
template <class Depth, class Fetch>
LC_FN float lookup_visibility(const MapView& view, Vec3 local, Vec3 normal, int size, const Fetch& fetch) {
  const bool paraboloid = view.half_width == 0;
  const float texel = 2.0f / static_cast<float>(size), step = view.far / kDepthSteps<Depth>;
  TapPlane<float> plane = paraboloid ? tap_plane_paraboloid(local, normal, texel, step)
                                     : tap_plane_orthographic(local, normal, view.half_width, texel, step);
  const float last = static_cast<float>(size - 1), half = 0.5f * static_cast<float>(size);
  const int x = static_cast<int>(clamp_to((plane.at.u + 1) * half, 0.0f, last));
  const int y = static_cast<int>(clamp_to((plane.at.v + 1) * half, 0.0f, last));
  const auto passes = [&](int tap) {
    const int i = clamp_to(x + tap_x(tap), 0, size - 1), j = clamp_to(y + tap_y(tap), 0, size - 1);
    const Depth code = fetch(i, j);
    if (code == kNoDepth<Depth>) return 1.0f;
    return tap_passes(plane, texel_centre(i, size), texel_centre(j, size), static_cast<float>(code) * step, paraboloid);
  };
  // From the texel's centre to the receiver, in texels.
  const float right = (plane.at.u - texel_centre(x, size)) * half, up = (plane.at.v - texel_centre(y, size)) * half;
  const float middle = passes(0);
  float share = middle * (1 - std::fabs(right) - std::fabs(up));
  if (middle > 0) plane.bias = step + (plane.bias - step) * (kBesideBiasTexels / kBiasTexels);
  for (int tap = 1; tap < kTaps; ++tap) {
    const float weight = static_cast<float>(tap_x(tap)) * right + static_cast<float>(tap_y(tap)) * up;
    if (weight > 0) share += weight * passes(tap);
  }
  return max_of(share, 0.0f);
}

}  // namespace lightcuts
