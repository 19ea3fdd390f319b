#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/bits.h"
#include "kernels/light.h"
#include "kernels/shadow_map.h"
#include "lightcuts/scene.h"

namespace lightcuts {

// Lookups in shadow maps, a thread at a time: lookup_visibility of shadow_map.h with the work that all lookups of a map
// share done once, and with what follows from the projection's geometry left out. Up to rounding both agree.
//
// Depths are counted in codes here. On the way from the light w = (u, v, 1) h - (0, 0, 1), h = (d + z) / d, so
// h (u n.x + v n.y + n.z) = dot(w, n) + n.z; and a stored depth beyond every surface passes without being asked.

/// How one map looks at the world, and what its depths are counted in: 64 bytes, read as four words of 16.
struct alignas(16) MapRecord {
  Vec3 origin;       ///< [m]
  float steps;       ///< depth codes a metre
  Vec3 x;            ///< axes of the view
  float bias_steps;  ///< what is allowed for each metre of h d (paraboloid), or in all (orthographic), in codes
  Vec3 y;
  float half_width;  ///< 0: a paraboloid [m]
  Vec3 z;
  float rim_sq;  ///< see MapView
};
static_assert(sizeof(MapRecord) == 64);

template <class Depth>
LC_KERNEL MapRecord make_map_record(const MapView& view, int size) {
  const float steps = kDepthSteps<Depth> / max_of(view.far, 1e-30f);
  const float texel = 2.0f / static_cast<float>(size), spread = view.half_width == 0 ? 1.0f : view.half_width;
  MapRecord map;
  map.origin = view.origin;
  map.steps = steps;
  map.x = view.frame.x;
  map.bias_steps = kBiasTexels * texel * spread * steps;
  map.y = view.frame.y;
  map.half_width = view.half_width;
  map.z = view.frame.z;
  map.rim_sq = view.rim_sq;
  return map;
}

/// The view that a record was made of, as far as drawing needs it.
LC_KERNEL MapView view_of(const MapRecord& map) {
  MapView view;
  view.origin = map.origin;
  view.frame = {map.x, map.y, map.z};
  view.half_width = map.half_width;
  view.rim_sq = map.rim_sq;
  return view;
}

namespace detail {

/// 1 / v and 1 / sqrt(v) to a unit or two of rounding; v > 0, neither tiny nor huge.
LC_KERNEL float quick_reciprocal(float v) {
#if defined(__CUDA_ARCH__)
  float r;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(v));
  return r;
#else
  return 1 / v;
#endif
}
LC_KERNEL float quick_inverse_root(float v) {
#if defined(__CUDA_ARCH__)
  float r;
  asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(v));
  return r;
#else
  return 1 / std::sqrt(v);
#endif
}

/// The larger and the smaller of two numbers, neither a NaN, in one instruction.
LC_KERNEL float larger(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fmaxf(a, b);
#else
  return max_of(a, b);
#endif
}
LC_KERNEL float smaller(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fminf(a, b);
#else
  return min_of(a, b);
#endif
}

/// Adding it to a number from 0 to 2^22 rounds that to a whole one, which is then the low bits of the sum.
inline constexpr float kWholeMagic = 8388608.0f;  // 2^23
inline constexpr std::uint32_t kWholeBits = 0x4b000000u;

/// What the taps of one receiver are compared with. A tap passes where (code + bias) max(change, 1) >= depth, or, of
/// orthographic maps, where code + bias >= depth + min(change, 0).
template <class T>
struct TapTest {
  T minus_depth, bias;           ///< [codes]
  T change, change_x, change_y;  ///< at the centre tap; from a texel to the next
  T x, y;                        ///< the centre texel, whole numbers plus kWholeMagic
  T rest_x, rest_y;              ///< from the receiver to its centre, in texels
};

/// The receiver's texel along one axis: `at` is its coordinate in [-1, 1].
template <class T>
struct TexelPlace {
  T index;  ///< plus kWholeMagic
  T rest;   ///< from the receiver to the texel's centre, in texels
};
template <class T>
LC_KERNEL TexelPlace<T> texel_place(T at, int size) {
  const float half = 0.5f * static_cast<float>(size);
  const T place = at * T(half) + T(half - 0.5f);
  const T index = smaller(larger(place, T(0.0f)), T(static_cast<float>(size - 1))) + T(kWholeMagic);
  return {index, (index - T(kWholeMagic)) - place};
}

/// 1 / v, where v is taken for a small number of its sign if it is nearer to 0.
LC_KERNEL float inverse_facing(float v) {
#if defined(__CUDA_ARCH__)
  return quick_reciprocal(copysignf(fmaxf(fabsf(v), kLeastFacing), v));
#else
  return 1 / away_from_zero(v);
#endif
}

template <class T>
LC_KERNEL TapTest<T> paraboloid_taps(const MapRecord& map, Vec3T<T> local, Vec3T<T> normal, int size) {
  const float texel = 2.0f / static_cast<float>(size);
  const T distance_sq = larger(dot(local, local), T(1e-30f));
  const T inverse = quick_inverse_root(distance_sq);
  const T distance = distance_sq * inverse, sum = larger(distance + local.z, T(1e-30f));
  const T scale = quick_reciprocal(sum);
  const T u = local.x * scale, v = local.y * scale;
  const T facing = dot(local, normal) * inverse;
  const T slope = (T(texel) * sum) * (inverse * inverse_facing(facing));
  const T minus_along = -facing - normal.z;
  const TexelPlace<T> x = texel_place(u, size), y = texel_place(v, size);
  TapTest<T> test;
  test.minus_depth = -distance * T(map.steps);
  test.bias = sum * T(map.bias_steps) + T(1.0f);
  test.change_x = slope * (u * minus_along + normal.x);
  test.change_y = slope * (v * minus_along + normal.y);
  test.change = test.change_x * x.rest + (test.change_y * y.rest + T(1.0f));
  test.x = x.index;
  test.y = y.index;
  test.rest_x = x.rest;
  test.rest_y = y.rest;
  return test;
}

template <class T>
LC_KERNEL TapTest<T> orthographic_taps(const MapRecord& map, Vec3T<T> local, Vec3T<T> normal, int size) {
  const float texel = 2.0f / static_cast<float>(size);
  const T scale(1 / map.half_width);
  const T slope = T(-texel * map.half_width * map.steps) * inverse_facing(normal.z);
  const TexelPlace<T> x = texel_place(local.x * scale, size), y = texel_place(local.y * scale, size);
  TapTest<T> test;
  test.minus_depth = -local.z * T(map.steps);
  test.bias = T(map.bias_steps + 1);
  test.change_x = slope * normal.x;
  test.change_y = slope * normal.y;
  test.change = test.change_x * x.rest + test.change_y * y.rest;
  test.x = x.index;
  test.y = y.index;
  test.rest_x = x.rest;
  test.rest_y = y.rest;
  return test;
}

/// A stored code plus a bias. Of 16-bit codes the bias is rounded to a whole one: then the sum costs two operations that
/// every GPU does at full speed, where a conversion would be four times as slow.
template <class Depth>
struct BiasedCode {
  float shift;

  LC_KERNEL explicit BiasedCode(float bias) {
    if constexpr (sizeof(Depth) == 2) {
      shift = (bias + kWholeMagic) - 2 * kWholeMagic;
    } else {
      shift = bias;
    }
  }
  LC_KERNEL float operator()(Depth code) const {
    if constexpr (sizeof(Depth) == 2) {
      return float_of(kWholeBits | code) + shift;
    } else {
      return static_cast<float>(code) + shift;
    }
  }
};

/// Below 0 where the tap is blocked.
template <bool Paraboloid>
LC_KERNEL float tap_margin(const TapTest<float>& test, float change, float reach) {
  return Paraboloid ? reach * larger(change, 1.0f) + test.minus_depth
                    : reach + (test.minus_depth - smaller(change, 0.0f));
}

/// The bias of the taps beside a receiver's own that lets light pass, from that one's: a code and texels [codes].
template <class T>
LC_KERNEL T bias_beside(T bias) {
  constexpr float kRatio = kBesideBiasTexels / kBiasTexels;
  return bias * T(kRatio) - T(kRatio - 1);
}

/// a where b is below 0, else -a.
LC_KERNEL float against(float a, float b) { return float_of(bits_of(a) ^ (~bits_of(b) & 0x80000000u)); }

/// Asks the texel `at` and those two beside it that are nearest to the receiver, `beside` and `above` texels on. The other
/// two of the plus count nothing.
template <class Depth, bool Paraboloid>
LC_KERNEL float share_of_taps(const TapTest<float>& test, float change_x, float change_y, int beside, int above,
                              const Depth* at) {
  const bool passes = !(tap_margin<Paraboloid>(test, test.change, BiasedCode<Depth>(test.bias)(at[0])) < 0);
  const BiasedCode<Depth> reach(passes ? bias_beside(test.bias) : test.bias);
  const float x = tap_margin<Paraboloid>(test, test.change + change_x, reach(at[beside]));
  const float y = tap_margin<Paraboloid>(test, test.change + change_y, reach(at[above]));
  const float weight_x = std::fabs(test.rest_x), weight_y = std::fabs(test.rest_y);
  const float of_x = x < 0 ? 0.0f : weight_x, of_y = y < 0 ? 0.0f : weight_y;
  return larger((passes ? 1 - weight_x - weight_y : 0.0f) + (of_x + of_y), 0.0f);  // by rounding it may be below 0
}

/// The same where none of the texels lies beyond the map.
template <class Depth, bool Paraboloid>
LC_KERNEL float share_of_inner_taps(const TapTest<float>& test, int side, const Depth* at) {
  return share_of_taps<Depth, Paraboloid>(test, against(test.change_x, test.rest_x),
                                          against(test.change_y, test.rest_y), test.rest_x < 0 ? 1 : -1,
                                          test.rest_y < 0 ? side : -side, at);
}

/// The same of any texel: one at the map's border stands for its missing neighbours.
template <class Depth, bool Paraboloid>
LC_KERNEL float share_of_border_taps(const TapTest<float>& test, int x, int y, int side, const Depth* codes) {
  const int i = clamp_to(x + (test.rest_x < 0 ? 1 : -1), 0, side - 1) - x;
  const int j = clamp_to(y + (test.rest_y < 0 ? 1 : -1), 0, side - 1) - y;
  return share_of_taps<Depth, Paraboloid>(test, static_cast<float>(i) * test.change_x,
                                          static_cast<float>(j) * test.change_y, i, j * side, codes + (y * side + x));
}

/// Asks the taps; `Size` 0: as `size` says, which must be a power of two or `Size`.
template <class Depth, bool Paraboloid, int Size>
LC_KERNEL float ask_taps(const TapTest<float>& test, int size, const Depth* codes) {
  const int side = Size > 0 ? Size : size;
  const std::uint32_t x = bits_of(test.x) - kWholeBits, y = bits_of(test.y) - kWholeBits;
  const auto inner = static_cast<std::uint32_t>(side - 2);
  if (x - 1 < inner && y - 1 < inner) {
    return share_of_inner_taps<Depth, Paraboloid>(test, side, codes + (y * static_cast<std::uint32_t>(side) + x));
  }
  return share_of_border_taps<Depth, Paraboloid>(test, static_cast<int>(x), static_cast<int>(y), side, codes);
}

/// Taps whose texel, by rounding, can lie just beyond the map.
struct FacingTaps {
  TapTest<float> test;
  float out;  ///< from the map's middle, by the larger coordinate, the border being at 1
};

/// paraboloid_taps of a receiver in front of a light that it faces, without the limits that it then needs not.
LC_KERNEL FacingTaps facing_taps(const MapRecord& map, Vec3 local, Vec3 normal, float distance_sq, float along,
                                 int size) {
  const float texel = 2.0f / static_cast<float>(size), half = 0.5f * static_cast<float>(size);
  const float inverse = quick_inverse_root(larger(distance_sq, 1e-30f));
  const float distance = distance_sq * inverse, sum = distance + local.z, scale = quick_reciprocal(sum);
  const float u = local.x * scale, v = local.y * scale;
  const float facing = along * inverse;
  const float slope = (texel * sum) * (inverse * quick_reciprocal(larger(facing, kLeastFacing)));
  const float minus_along = -facing - normal.z;
  const float place_x = u * half + (half - 0.5f), place_y = v * half + (half - 0.5f);
  FacingTaps taps;
  TapTest<float>& test = taps.test;
  test.minus_depth = -distance * map.steps;
  test.bias = sum * map.bias_steps + 1;
  test.change_x = slope * (u * minus_along + normal.x);
  test.change_y = slope * (v * minus_along + normal.y);
  test.x = place_x + kWholeMagic;
  test.y = place_y + kWholeMagic;
  test.rest_x = (test.x - kWholeMagic) - place_x;
  test.rest_y = (test.y - kWholeMagic) - place_y;
  test.change = test.change_x * test.rest_x + (test.change_y * test.rest_y + 1);
  taps.out = larger(std::fabs(u), std::fabs(v));
  return taps;
}

template <class Depth, int Size>
LC_KERNEL float ask_facing_taps(const FacingTaps& taps, int size, const Depth* codes) {
  const int side = Size > 0 ? Size : size;
  TapTest<float> test = taps.test;
  // Not at the border, by more than rounding.
  if (taps.out < (1 - 1e-6f) - 2.0f / static_cast<float>(side)) {
    const std::uint32_t x = bits_of(test.x) - kWholeBits, y = bits_of(test.y) - kWholeBits;
    return share_of_inner_taps<Depth, true>(test, side, codes + (y * static_cast<std::uint32_t>(side) + x));
  }
  const float last = static_cast<float>(side - 1), at_x = test.x - kWholeMagic, at_y = test.y - kWholeMagic;
  const float x = smaller(larger(at_x, 0.0f), last), y = smaller(larger(at_y, 0.0f), last);
  test.rest_x += x - at_x;
  test.rest_y += y - at_y;
  test.change += (x - at_x) * test.change_x + (y - at_y) * test.change_y;
  return share_of_border_taps<Depth, true>(test, static_cast<int>(x), static_cast<int>(y), side, codes);
}

}  // namespace detail

/// Where a map sees a receiver.
LC_FN Vec3 to_map(const MapRecord& map, Vec3 position) {
  const Vec3 d = position - map.origin;
  return {dot(d, map.x), dot(d, map.y), dot(d, map.z)};
}

/// Share of light that arrives at a receiver: a plus of lookups, averaged by the receiver's place; see lookup_visibility.
///
/// @param local   to_map(map, position)
/// @param ng      its unit geometric normal, world space; on which side does not matter
/// @param codes   the map's, row by row, `size` * `size`
/// The view's kind is a template parameter, as all maps of a kind of light have it; so is the size where it is known.
template <class Depth, bool Paraboloid, int Size = 0>
LC_KERNEL float look_up_map(const MapRecord& map, Vec3 local, Vec3 ng, int size, const Depth* codes) {
  const Vec3 normal{dot(ng, map.x), dot(ng, map.y), dot(ng, map.z)};
  const int side = Size > 0 ? Size : size;
  const detail::TapTest<float> test = Paraboloid ? detail::paraboloid_taps(map, local, normal, side)
                                                 : detail::orthographic_taps(map, local, normal, side);
  return detail::ask_taps<Depth, Paraboloid, Size>(test, side, codes);
}

/// The same for loops that know more of a receiver: it lies in front of a VPL, and its surface faces the light.
///
/// @param normal       dots with the map's axes of its unit geometric normal, turned away from the light
/// @param distance_sq  dot(local, local)
/// @param along        dot(local, normal), above 0, as local.z is
template <class Depth, int Size = 0>
LC_KERNEL float look_up_facing(const MapRecord& map, Vec3 local, Vec3 normal, float distance_sq, float along, int size,
                               const Depth* codes) {
  const int side = Size > 0 ? Size : size;
  return detail::ask_facing_taps<Depth, Size>(detail::facing_taps(map, local, normal, distance_sq, along, side), side,
                                              codes);
}

/// The maps of some lights. Slots name maps: slot s has records[s] and the codes from s * size^2 on.
struct MapSetView {
  const std::uint32_t* vpl_slots = nullptr;    ///< of each light its (first) map, kNone: none yet
  const std::uint32_t* point_slots = nullptr;  ///< the second hemisphere, if any, is the next slot
  const std::uint32_t* directional_slots = nullptr;
  const MapRecord* records = nullptr;
  const void* codes = nullptr;  ///< 16 or 32 bits each
  std::int32_t size = 0;        ///< texels a side
  std::int32_t depth_bits = 16;
};

/// Share of light that arrives from the light whose map is in `slot`.
template <bool Paraboloid, int Size = 0>
LC_KERNEL float look_up_slot(const MapSetView& maps, std::uint32_t slot, const MapRecord& map, Vec3 local, Vec3 ng) {
  const std::size_t texels = static_cast<std::size_t>(maps.size) * static_cast<std::size_t>(maps.size);
  if (maps.depth_bits == 16) {
    return look_up_map<std::uint16_t, Paraboloid, Size>(map, local, ng, maps.size,
                                                        static_cast<const std::uint16_t*>(maps.codes) + slot * texels);
  }
  return look_up_map<std::uint32_t, Paraboloid, Size>(map, local, ng, maps.size,
                                                      static_cast<const std::uint32_t*>(maps.codes) + slot * texels);
}

// Shares of one light of each kind; 1 for a light without a map. `position` and `ng` are the receiver's.

LC_KERNEL float vpl_share(const MapSetView& maps, std::uint32_t light, Vec3 position, Vec3 ng) {
  const std::uint32_t slot = maps.vpl_slots[light];
  if (slot == kNone) return 1;
  const MapRecord map = maps.records[slot];
  return look_up_slot<true>(maps, slot, map, to_map(map, position), ng);
}

/// @param cos_outer  the spot's: whether there are two maps
LC_KERNEL float point_share(const MapSetView& maps, std::uint32_t light, float cos_outer, Vec3 position, Vec3 ng) {
  std::uint32_t slot = maps.point_slots[light];
  if (slot == kNone) return 1;
  MapRecord map = maps.records[slot];
  if (cos_outer < 0 && dot(position - map.origin, map.z) < 0) map = maps.records[++slot];
  return look_up_slot<true>(maps, slot, map, to_map(map, position), ng);
}

LC_KERNEL float directional_share(const MapSetView& maps, std::uint32_t light, Vec3 position, Vec3 ng) {
  const std::uint32_t slot = maps.directional_slots[light];
  if (slot == kNone) return 1;
  const MapRecord map = maps.records[slot];
  return look_up_slot<false>(maps, slot, map, to_map(map, position), ng);
}

}  // namespace lightcuts
