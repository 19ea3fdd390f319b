// How shadow maps are looked up: part of ism_kernels_body.h.
// No include guard on purpose.

namespace lightcuts::LC_ISA {
namespace {

/// The codes of the five taps of a register of receivers, as numbers.
struct TapCodes {
  Lanes centre, right, left, above, below;
};

/// A tap's place, whole numbers in [0, size).
struct TapPlaces {
  Lanes centre, right, left, above, below;  ///< row times size plus column
  Mask at_right, at_left;                   ///< the centre lies in the last, the first column
};

LC_LANES_FN TapPlaces tap_places(Lanes x, Lanes y, int size) {
  const Lanes zero(0.0f), one(1.0f), side(static_cast<float>(size)), last(static_cast<float>(size - 1));
  const Lanes row = y * side, centre = row + x;
  return {centre,
          row + min_of(x + one, last),
          row + max_of(x - one, zero),
          min_of(y + one, last) * side + x,
          max_of(y - one, zero) * side + x,
          x > last - one,
          x < one};
}

#if defined(__AVX512F__)
LC_LANES_FN __m512i gather_words(const void* codes, Lanes index, std::uint32_t lanes) {
  return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), static_cast<__mmask16>(lanes),
                                     _mm512_cvttps_epi32(index.value), codes, 2);
}
LC_LANES_FN Lanes low_codes(__m512i words) {
  return Batch(_mm512_cvtepi32_ps(_mm512_and_si512(words, _mm512_set1_epi32(0xffff))));
}
LC_LANES_FN Lanes high_codes(__m512i words) { return Batch(_mm512_cvtepi32_ps(_mm512_srli_epi32(words, 16))); }

/// One reading of four codes holds a row's three taps.
LC_LANES_FN TapCodes gather_taps(const std::uint16_t* codes, const TapPlaces& at, std::uint32_t lanes) {
  const __m512i index = _mm512_sub_epi32(_mm512_cvttps_epi32(at.centre.value), _mm512_set1_epi32(1));
  const __m512i none = _mm512_setzero_si512();
  const __m512i first =
      _mm512_mask_i32gather_epi64(none, static_cast<__mmask8>(lanes & 0xff), _mm512_castsi512_si256(index), codes, 2);
  const __m512i second = _mm512_mask_i32gather_epi64(none, static_cast<__mmask8>(lanes >> 8),
                                                     _mm512_extracti64x4_epi64(index, 1), codes, 2);
  const __m512i even = _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
  const __m512i lower = _mm512_permutex2var_epi32(first, even, second);
  const __m512i upper = _mm512_permutex2var_epi32(first, _mm512_add_epi32(even, _mm512_set1_epi32(1)), second);
  const Lanes centre = high_codes(lower);
  return {centre, select(at.at_right, centre, low_codes(upper)), select(at.at_left, centre, low_codes(lower)),
          low_codes(gather_words(codes, at.above, lanes)), low_codes(gather_words(codes, at.below, lanes))};
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

/// One reading of four codes holds a row's three taps.
LC_LANES_FN TapCodes gather_taps(const std::uint16_t* codes, const TapPlaces& at, std::uint32_t lanes) {
  const __m256i mask = mask_of(lanes), none = _mm256_setzero_si256();
  const __m256i index = _mm256_sub_epi32(_mm256_cvttps_epi32(at.centre.value), _mm256_set1_epi32(1));
  const auto* from = reinterpret_cast<const long long*>(codes);
  const __m256i first = _mm256_mask_i32gather_epi64(none, from, _mm256_castsi256_si128(index),
                                                    _mm256_cvtepi32_epi64(_mm256_castsi256_si128(mask)), 2);
  const __m256i second = _mm256_mask_i32gather_epi64(none, from, _mm256_extracti128_si256(index, 1),
                                                     _mm256_cvtepi32_epi64(_mm256_extracti128_si256(mask, 1)), 2);
  const __m256 a = _mm256_castsi256_ps(first), b = _mm256_castsi256_ps(second);
  // Shuffling works within halves: their quarters come out of order.
  const __m256i lower = _mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(a, b, 0x88)), 0xd8);
  const __m256i upper = _mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(a, b, 0xdd)), 0xd8);
  const Lanes centre = high_codes(lower);
  return {centre, select(at.at_right, centre, low_codes(upper)), select(at.at_left, centre, low_codes(lower)),
          low_codes(gather_words(codes, at.above, mask)), low_codes(gather_words(codes, at.below, mask))};
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
  return {fetch(codes, at.centre), fetch(codes, at.right), fetch(codes, at.left), fetch(codes, at.above),
          fetch(codes, at.below)};
}

/// 1 where a tap lets light pass. `change`: of the plane at the tap, as TapTest has it.
template <bool Paraboloid>
LC_LANES_FN Lanes tap_passes(Lanes depth, Lanes bias, Lanes change, Lanes code) {
  const Lanes zero(0.0f), one(1.0f), reach = code + bias;
  if constexpr (Paraboloid) return select(reach * max_of(change, one) < depth, zero, one);
  return select(reach < depth + min_of(change, zero), zero, one);
}

/// look_up_map for a register of receivers.
template <bool Paraboloid, class Depth>
LC_LANES_FN Lanes look_up_lanes(const MapRecord& map, LanesVec3 local, LanesVec3 normal, const Depth* codes, int size,
                                std::uint32_t lanes) {
  const detail::TapTest<Lanes> test = Paraboloid ? detail::paraboloid_taps(map, local, normal, size)
                                                 : detail::orthographic_taps(map, local, normal, size);
  const Lanes x = test.x - Lanes(detail::kWholeMagic), y = test.y - Lanes(detail::kWholeMagic);
  const TapPlaces at = tap_places(x, y, size);
  const TapCodes code = gather_taps(codes, at, lanes);
  // Where nothing was drawn a tap passes, even if the receiver lies beyond all surfaces.
  const Lanes depth = min_of(-test.minus_depth, Lanes(static_cast<float>(kNoDepth<Depth>)));
  // At the border the texel stands for its missing neighbour.
  const Lanes zero(0.0f), one(1.0f), last(static_cast<float>(size - 1));
  const Lanes right = select(at.at_right, zero, test.change_x), left = select(at.at_left, zero, test.change_x);
  const Lanes above = select(y > last - one, zero, test.change_y), below = select(y < one, zero, test.change_y);
  const Lanes passed = tap_passes<Paraboloid>(depth, test.bias, test.change, code.centre) +
                       tap_passes<Paraboloid>(depth, test.bias, test.change + right, code.right) +
                       tap_passes<Paraboloid>(depth, test.bias, test.change - left, code.left) +
                       tap_passes<Paraboloid>(depth, test.bias, test.change + above, code.above) +
                       tap_passes<Paraboloid>(depth, test.bias, test.change - below, code.below);
  return passed * Lanes(1.0f / kTaps);
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
