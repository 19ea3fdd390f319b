// How shadow maps are looked up: part of ism_kernels_body.h.
// No include guard on purpose.

namespace lightcuts::LC_ISA {
namespace {

/// The codes of the taps of a register of receivers, as numbers: their own texels, and the nearest ones beside and above
/// or below.
struct TapCodes {
  Lanes middle, beside, above;
};

/// A tap's place: row times size plus column, whole numbers.
struct TapPlaces {
  Lanes middle, beside, above;
};

#if defined(__AVX512F__)
LC_LANES_FN __m512i gather_words(const void* codes, Lanes index, std::uint32_t lanes) {
  return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), static_cast<__mmask16>(lanes),
                                     _mm512_cvttps_epi32(index.value), codes, 2);
}
LC_LANES_FN Lanes low_codes(__m512i words) {
  return Batch(_mm512_cvtepi32_ps(_mm512_and_si512(words, _mm512_set1_epi32(0xffff))));
}
LC_LANES_FN Lanes high_codes(__m512i words) { return Batch(_mm512_cvtepi32_ps(_mm512_srli_epi32(words, 16))); }

/// One reading of two codes holds the texel and the one beside it.
LC_LANES_FN TapCodes gather_taps(const std::uint16_t* codes, const TapPlaces& at, std::uint32_t lanes) {
  const __m512i both = gather_words(codes, min_of(at.middle, at.beside), lanes);
  const Lanes left = low_codes(both), right = high_codes(both);
  const Mask on_right = at.beside > at.middle, on_left = at.beside < at.middle;
  return {select(on_left, right, left), select(on_right, right, left), low_codes(gather_words(codes, at.above, lanes))};
}
#elif defined(__AVX2__)
LC_LANES_FN __m256i mask_of(std::uint32_t lanes) {
  const __m256i bit = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
  return _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(static_cast<int>(lanes)), bit), bit);
}
LC_LANES_FN __m256i gather_words(const void* codes, Lanes index, __m256i mask) {
  return _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), static_cast<const int*>(codes),
                                     _mm256_cvttps_epi32(index.value), mask, 2);
}
LC_LANES_FN Lanes low_codes(__m256i words) {
  return Batch(_mm256_cvtepi32_ps(_mm256_and_si256(words, _mm256_set1_epi32(0xffff))));
}
LC_LANES_FN Lanes high_codes(__m256i words) { return Batch(_mm256_cvtepi32_ps(_mm256_srli_epi32(words, 16))); }

/// One reading of two codes holds the texel and the one beside it.
LC_LANES_FN TapCodes gather_taps(const std::uint16_t* codes, const TapPlaces& at, std::uint32_t lanes) {
  const __m256i mask = mask_of(lanes), both = gather_words(codes, min_of(at.middle, at.beside), mask);
  const Lanes left = low_codes(both), right = high_codes(both);
  const Mask on_right = at.beside > at.middle, on_left = at.beside < at.middle;
  return {select(on_left, right, left), select(on_right, right, left), low_codes(gather_words(codes, at.above, mask))};
}
#endif

/// Codes at places, as numbers; one at a time.
template <class Depth>
LC_LANES_FN Lanes fetch(const Depth* codes, Lanes index) {
  alignas(64) float at[Lanes::kCount], found[Lanes::kCount];
  index.store(at);
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    found[lane] = static_cast<float>(codes[static_cast<std::size_t>(at[lane])]);
  }
  return Lanes::load(found);
}
template <class Depth>
LC_LANES_FN TapCodes gather_taps(const Depth* codes, const TapPlaces& at, std::uint32_t) {
  return {fetch(codes, at.middle), fetch(codes, at.beside), fetch(codes, at.above)};
}

/// Where a tap is blocked. `change`: of the plane at the tap, as TapTest has it.
template <bool Paraboloid>
LC_LANES_FN Mask tap_blocked(Lanes depth, Lanes bias, Lanes change, Lanes code) {
  const Lanes reach = code + bias;
  if constexpr (Paraboloid) return reach * max_of(change, Lanes(1.0f)) < depth;
  return reach < depth + min_of(change, Lanes(0.0f));
}

/// look_up_map for a register of receivers.
template <bool Paraboloid, class Depth>
LC_LANES_FN Lanes look_up_lanes(const MapRecord& map, LanesVec3 local, LanesVec3 normal, const Depth* codes, int size,
                                std::uint32_t lanes) {
  const detail::TapTest<Lanes> test = Paraboloid ? detail::paraboloid_taps(map, local, normal, size)
                                                 : detail::orthographic_taps(map, local, normal, size);
  const Lanes zero(0.0f), one(1.0f), side(static_cast<float>(size)), last(static_cast<float>(size - 1));
  const Lanes x = test.x - Lanes(detail::kWholeMagic), y = test.y - Lanes(detail::kWholeMagic);
  // At the border the texel stands for its missing neighbour.
  const Lanes to_x = select(test.rest_x < zero, min_of(last - x, one), max_of(-x, -one));
  const Lanes to_y = select(test.rest_y < zero, min_of(last - y, one), max_of(-y, -one));
  const Lanes middle = y * side + x;
  const TapCodes code = gather_taps(codes, {middle, middle + to_x, middle + to_y * side}, lanes);
  // Where nothing was drawn a tap passes, even if the receiver lies beyond all surfaces.
  const Lanes depth = min_of(-test.minus_depth, Lanes(static_cast<float>(kNoDepth<Depth>)));
  const Mask dark = tap_blocked<Paraboloid>(depth, test.bias, test.change, code.middle);
  const Lanes bias = select(dark, test.bias, detail::bias_beside(test.bias));
  const Mask dark_x = tap_blocked<Paraboloid>(depth, bias, test.change + to_x * test.change_x, code.beside);
  const Mask dark_y = tap_blocked<Paraboloid>(depth, bias, test.change + to_y * test.change_y, code.above);
  const Lanes weight_x = max_of(test.rest_x, -test.rest_x), weight_y = max_of(test.rest_y, -test.rest_y);
  const Lanes share =
      select(dark, zero, one - weight_x - weight_y) + (select(dark_x, zero, weight_x) + select(dark_y, zero, weight_y));
  return max_of(share, zero);  // by rounding it may be below 0
}

LC_LANES_FN LanesVec3 to_axes(const MapRecord& map, LanesVec3 v) {
  return {dot(v, broadcast(map.x)), dot(v, broadcast(map.y)), dot(v, broadcast(map.z))};
}

template <bool Paraboloid, class Depth>
LC_LANES_FN void look_up_packet(const ReceiverPacket& receivers, std::uint32_t candidates, const MapRecord& record,
                                const DepthCodes& map, float* share) {
  const auto* codes = static_cast<const Depth*>(map.codes);
  for (int first = 0; first < kPacketSize; first += Lanes::kCount) {
    const std::uint32_t lanes = candidates >> first & Lanes::kAllBits;
    Lanes found(0.0f);
    if (lanes != 0) {
      const LanesVec3 local = to_axes(record, load(receivers.position, first) - broadcast(record.origin));
      const LanesVec3 normal = to_axes(record, load(receivers.ng, first));
      const Lanes asked = look_up_lanes<Paraboloid>(record, local, normal, codes, map.size, lanes);
      found = select(Mask{lanes_of(lanes)}, asked, found);
    }
    found.store(share + first);
  }
}

void look_up(const ReceiverPacket& receivers, std::uint32_t candidates, const MapRecord& record, const DepthCodes& map,
             float* share) {
  const bool paraboloid = record.half_width == 0;
  if (map.depth_bits == 16) {
    paraboloid ? look_up_packet<true, std::uint16_t>(receivers, candidates, record, map, share)
               : look_up_packet<false, std::uint16_t>(receivers, candidates, record, map, share);
  } else {
    paraboloid ? look_up_packet<true, std::uint32_t>(receivers, candidates, record, map, share)
               : look_up_packet<false, std::uint32_t>(receivers, candidates, record, map, share);
  }
}

}  // namespace
}  // namespace lightcuts::LC_ISA
