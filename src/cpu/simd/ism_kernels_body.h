// The text of the shadow map kernels, included once by each ism_kernels_ISA.cpp, which defines LC_ISA.
// No include guard on purpose.

#include "cpu/simd/ism_kernels.h"
#include "cpu/simd/lanes.h"

namespace lightcuts::LC_ISA {
namespace {

using LanesVec3 = Vec3T<Lanes>;

LC_LANES_FN LanesVec3 broadcast(const Vec3& v) { return {Lanes(v.x), Lanes(v.y), Lanes(v.z)}; }

LC_LANES_FN LanesVec3 load(const PacketVec3& v, int first) {
  return {Lanes::load(v.x + first), Lanes::load(v.y + first), Lanes::load(v.z + first)};
}

LC_LANES_FN Lanes load_unaligned(const float* from) { return Batch::load_unaligned(from); }

LC_LANES_FN LanesVec3 load_unaligned(const float* x, const float* y, const float* z, std::size_t first) {
  return {load_unaligned(x + first), load_unaligned(y + first), load_unaligned(z + first)};
}

// --- Drawing ---

/// A register of points in a view's coordinates, one a lane.
struct alignas(64) ProjectedPoints {
  float x[Lanes::kCount], y[Lanes::kCount], z[Lanes::kCount];
  float normal_x[Lanes::kCount], normal_y[Lanes::kCount], normal_z[Lanes::kCount];
  float plane[Lanes::kCount];
  float u[Lanes::kCount], v[Lanes::kCount], radius[Lanes::kCount];  // the footprint in texels
};

/// Brings points into the view's coordinates; returns the lanes that the map can see.
template <bool Paraboloid>
LC_LANES_FN std::uint32_t project(const PointArrays& points, std::size_t first, const MapView& view, float radius,
                                  float texels, ProjectedPoints& out) {
  const LanesVec3 local = to_local_point(view, load_unaligned(points.x, points.y, points.z, first));
  Mask seen = local.z > Lanes(0.0f);
  if constexpr (Paraboloid) {
    // Discs reach a little higher than their points; a point below the horizon is left out as a whole.
    const Lanes least(kLeastCosine);
    seen = local.z > least * square_root(dot(local, local));
    // Where texels beyond the rim are drawn (point lights), discs of points beyond it serve them.
    if (view.rim_sq > 1) seen = local.z > Lanes(-radius);
  }
  const std::uint32_t lanes = bits(seen);
  if (lanes == 0) return 0;

  const LanesVec3 normal =
      to_local_vector(view.frame, load_unaligned(points.normal_x, points.normal_y, points.normal_z, first));
  const Footprint<Lanes> print =
      Paraboloid ? paraboloid_footprint(local, radius) : orthographic_footprint(local, radius, view.half_width);
  local.x.store(out.x);
  local.y.store(out.y);
  local.z.store(out.z);
  normal.x.store(out.normal_x);
  normal.y.store(out.normal_y);
  normal.z.store(out.normal_z);
  dot(local, normal).store(out.plane);
  const Lanes half(texels);
  ((print.u + Lanes(1.0f)) * half).store(out.u);
  ((print.v + Lanes(1.0f)) * half).store(out.v);
  (print.radius * half).store(out.radius);
  return lanes;
}

/// Draws the disc of one lane.
template <bool Paraboloid, bool Cut>
LC_LANES_FN void draw_disc(const ProjectedPoints& points, int lane, const DiscShape& shape, const MapView& view,
                           int size, float* depths) {
  const TexelRange columns = texel_range(points.u[lane], points.radius[lane], size);
  const TexelRange rows = texel_range(points.v[lane], points.radius[lane], size);
  if (columns.lo > columns.hi || rows.lo > rows.hi) return;

  alignas(64) static constexpr float kCounting[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const float texel = 2.0f / static_cast<float>(size);
  const LanesVec3 local = broadcast({points.x[lane], points.y[lane], points.z[lane]});
  const LanesVec3 normal = broadcast({points.normal_x[lane], points.normal_y[lane], points.normal_z[lane]});
  const Lanes plane(points.plane[lane]), radius_sq(shape.radius * shape.radius), rim_sq(view.rim_sq);
  const Lanes counting = Lanes::load(kCounting) * Lanes(texel);
  LocalEdges edges;
  if constexpr (Cut) edges = to_local(shape, view);

  for (int j = rows.lo; j <= rows.hi; ++j) {
    const Lanes v(texel_centre(j, size));
    for (int i = columns.lo; i <= columns.hi; i += Lanes::kCount) {
      const Lanes u = Lanes(texel_centre(i, size)) + counting;
      const PlaneHit<Lanes> hit = Paraboloid ? meet_plane_paraboloid(u, v, normal, plane)
                                             : meet_plane_orthographic(u, v, normal, plane, view.half_width);
      Mask drawn = (hit.depth > Lanes(0.0f)) & (length_sq(hit.position - local) < radius_sq);
      drawn = drawn & (u < Lanes(1.0f));  // a register that reaches past the row must not draw into the next
      if constexpr (Paraboloid) drawn = drawn & (u * u + v * v < rim_sq);
      if constexpr (Cut) {
        for (int e = 0; e < kDiscEdges; ++e) {
          drawn = drawn & (dot(broadcast(edges.inward[e]), hit.position) > Lanes(edges.offset[e]));
        }
      }
      float* const at = depths + static_cast<std::ptrdiff_t>(j) * size + i;
      const Lanes before = load_unaligned(at);
      select(drawn, min_of(hit.depth, before), before).value.store_unaligned(at);
    }
  }
}

template <bool Paraboloid>
LC_LANES_FN void draw_points(const PointArrays& points, std::size_t first, std::size_t count, const MapView& view,
                             int size, float* depths) {
  const float largest = points.shapes[0].radius;
  const float half = 0.5f * static_cast<float>(size);
  ProjectedPoints projected;
  const std::size_t end = first + count;
  for (std::size_t at = first; at < end; at += static_cast<std::size_t>(Lanes::kCount)) {
    std::uint32_t lanes = project<Paraboloid>(points, at, view, largest, half, projected);
    if (end - at < static_cast<std::size_t>(Lanes::kCount)) lanes &= (1u << (end - at)) - 1u;
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      const std::uint32_t which = points.shape[at + static_cast<std::size_t>(lane)];
      if (which <= 1) {
        draw_disc<Paraboloid, false>(projected, lane, points.shapes[which], view, size, depths);
      } else {
        draw_disc<Paraboloid, true>(projected, lane, points.shapes[which], view, size, depths);
      }
    }
  }
}

void draw(const PointArrays& points, std::size_t first, std::size_t count, const MapView& view, int size,
          float* depths) {
  if (view.half_width == 0) {
    draw_points<true>(points, first, count, view, size, depths);
  } else {
    draw_points<false>(points, first, count, view, size, depths);
  }
}

template <class Depth>
LC_LANES_FN void encode(const float* depths, std::size_t count, float steps_per_metre, Depth* codes) {
  for (std::size_t i = 0; i < count; ++i) {
    const Depth code = encode_depth<Depth>(depths[i], steps_per_metre);
    codes[i] = depths[i] < std::numeric_limits<float>::infinity() ? code : kNoDepth<Depth>;
  }
}
void encode16(const float* depths, std::size_t count, float steps_per_metre, std::uint16_t* codes) {
  encode(depths, count, steps_per_metre, codes);
}
void encode32(const float* depths, std::size_t count, float steps_per_metre, std::uint32_t* codes) {
  encode(depths, count, steps_per_metre, codes);
}

// --- Looking up ---

/// Codes at whole-numbered places `index`, as floats; kNoDepth becomes a number above all steps.
template <class Depth>
LC_LANES_FN Lanes gather_codes(const Depth* codes, Lanes index) {
#if defined(__AVX512F__)
  const __m512i at = _mm512_cvttps_epi32(index.value);
  __m512i found = _mm512_i32gather_epi32(at, codes, static_cast<int>(sizeof(Depth)));
  if constexpr (sizeof(Depth) == 2) found = _mm512_and_si512(found, _mm512_set1_epi32(0xffff));
  return Batch(_mm512_cvtepu32_ps(found));
#elif defined(__AVX2__)
  const __m256i at = _mm256_cvttps_epi32(index.value);
  __m256i found = _mm256_i32gather_epi32(reinterpret_cast<const int*>(codes), at, static_cast<int>(sizeof(Depth)));
  if constexpr (sizeof(Depth) == 2) {
    return Batch(_mm256_cvtepi32_ps(_mm256_and_si256(found, _mm256_set1_epi32(0xffff))));
  } else {
    // kNoDepth is negative as a signed number.
    const __m256i empty = _mm256_srai_epi32(found, 31);
    found = _mm256_andnot_si256(empty, found);
    return Batch(_mm256_or_ps(_mm256_castsi256_ps(_mm256_and_si256(empty, _mm256_set1_epi32(0x4f800000))),
                              _mm256_cvtepi32_ps(found)));
  }
#else
  alignas(64) float at[Lanes::kCount], found[Lanes::kCount];
  index.store(at);
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    found[lane] = static_cast<float>(codes[static_cast<std::size_t>(at[lane])]);
  }
  return Lanes::load(found);
#endif
}

LC_LANES_FN Lanes whole(Lanes v) { return xsimd::trunc(v.value); }

/// lookup_visibility for a register of receivers.
template <bool Paraboloid, class Depth>
LC_LANES_FN Lanes look_up_lanes(LanesVec3 local, LanesVec3 normal, const MapView& view, const Depth* codes, int size) {
  const float texel = 2.0f / static_cast<float>(size), step = view.far / kDepthSteps<Depth>;
  const TapPlane<Lanes> plane = Paraboloid ? tap_plane_paraboloid(local, normal, texel, step)
                                           : tap_plane_orthographic(local, normal, view.half_width, texel, step);
  const Lanes zero(0.0f), one(1.0f), last(static_cast<float>(size - 1)), half(0.5f * static_cast<float>(size));
  const Lanes x = whole(min_of(max_of((plane.at.u + one) * half, zero), last));
  const Lanes y = whole(min_of(max_of((plane.at.v + one) * half, zero), last));
  Lanes passed = zero;
  for (int tap = 0; tap < kTaps; ++tap) {
    const Lanes i = min_of(max_of(x + Lanes(static_cast<float>(tap_x(tap))), zero), last);
    const Lanes j = min_of(max_of(y + Lanes(static_cast<float>(tap_y(tap))), zero), last);
    const Lanes code = gather_codes(codes, j * Lanes(static_cast<float>(size)) + i);
    const Lanes u = (i + i + one) * Lanes(0.5f * texel) - one, v = (j + j + one) * Lanes(0.5f * texel) - one;
    const Lanes lit = tap_passes(plane, u, v, code * Lanes(step), Paraboloid);
    passed = passed + select(code > Lanes(kDepthSteps<Depth> + 0.5f), one, lit);
  }
  return passed * Lanes(1.0f / kTaps);
}

template <bool Paraboloid, class Depth>
LC_LANES_FN void look_up_packet(const ReceiverPacket& receivers, const MapView& view, const DepthCodes& map,
                                float* share) {
  const auto* codes = static_cast<const Depth*>(map.codes);
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const LanesVec3 local = to_local_point(view, load(receivers.position, first));
    const LanesVec3 normal = to_local_vector(view.frame, load(receivers.ng, first));
    look_up_lanes<Paraboloid>(local, normal, view, codes, map.size).store(share + first);
  }
}

void look_up(const ReceiverPacket& receivers, const MapView& view, const DepthCodes& map, float* share) {
  const bool paraboloid = view.half_width == 0;
  if (map.depth_bits == 16) {
    paraboloid ? look_up_packet<true, std::uint16_t>(receivers, view, map, share)
               : look_up_packet<false, std::uint16_t>(receivers, view, map, share);
  } else {
    paraboloid ? look_up_packet<true, std::uint32_t>(receivers, view, map, share)
               : look_up_packet<false, std::uint32_t>(receivers, view, map, share);
  }
}

}  // namespace

extern const IsmKernels ism_kernels;
const IsmKernels ism_kernels{draw, encode16, encode32, look_up};

}  // namespace lightcuts::LC_ISA
