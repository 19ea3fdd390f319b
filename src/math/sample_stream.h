#pragma once

#include <cstdint>

#include "lightcuts/math.h"

namespace lightcuts {

/// Four numbers of a stream, 32 bits each.
struct Sample4 {
  std::uint32_t bits[4];

  /// In [0, 1), a multiple of 2^-24.
  [[nodiscard]] LC_FN float unit(int i) const { return static_cast<float>(bits[i] >> 8) * 0x1p-24f; }
  [[nodiscard]] LC_FN Vec2 unit2(int i) const { return {unit(i), unit(i + 1)}; }
  /// In [0, 1), all 32 bits: to choose among very many.
  [[nodiscard]] LC_FN double unit_double(int i) const { return static_cast<double>(bits[i]) * 0x1p-32; }
};

/// Mixes all bits of a word: a bijection whose output looks random.
LC_FN std::uint32_t mix_bits(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}
LC_FN std::uint32_t combine_bits(std::uint32_t a, std::uint32_t b) { return mix_bits(a ^ (mix_bits(b) + 0x9e3779b9u)); }

/// Four random words of counter (c0, c1, c2) under `key`.
/// Source: Salmon et al. 2011, Philox-4x32 with ten rounds.
LC_FN Sample4 philox(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint64_t key) {
  std::uint32_t x0 = c0, x1 = c1, x2 = c2, x3 = 0;
  auto k0 = static_cast<std::uint32_t>(key), k1 = static_cast<std::uint32_t>(key >> 32);
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53u} * x0, b = std::uint64_t{0xCD9E8D57u} * x2;
    x0 = static_cast<std::uint32_t>(b >> 32) ^ x1 ^ k0;
    x2 = static_cast<std::uint32_t>(a >> 32) ^ x3 ^ k1;
    x1 = static_cast<std::uint32_t>(b);
    x3 = static_cast<std::uint32_t>(a);
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  return {{x0, x1, x2, x3}};
}

LC_FN std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xff00ff00u) >> 8) | ((x & 0x00ff00ffu) << 8);
  x = ((x & 0xf0f0f0f0u) >> 4) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x & 0xccccccccu) >> 2) | ((x & 0x33333333u) << 2);
  return ((x & 0xaaaaaaaau) >> 1) | ((x & 0x55555555u) << 1);
}

/// The first four dimensions of Sobol's sequence at `index`, before scrambling; each times 2^-32.
/// The direction numbers (Joe and Kuo 2008) follow from their recurrences, so that no table is needed on a device.
LC_FN Sample4 sobol4(std::uint32_t index) {
  Sample4 s{{reverse_bits(index), 0, 0, 0}};
  std::uint32_t a = 1u << 31;                                 // x + 1
  std::uint32_t b0 = 1u << 31, b1 = 3u << 30;                 // x^2 + x + 1
  std::uint32_t c0 = 1u << 31, c1 = 3u << 30, c2 = 1u << 29;  // x^3 + x + 1
  for (; index != 0; index >>= 1) {
    const std::uint32_t used = 0u - (index & 1u);
    s.bits[1] ^= a & used;
    s.bits[2] ^= b0 & used;
    s.bits[3] ^= c0 & used;
    a ^= a >> 1;
    const std::uint32_t b2 = b1 ^ b0 ^ (b0 >> 2), c3 = c1 ^ c0 ^ (c0 >> 3);
    b0 = b1;
    b1 = b2;
    c0 = c1;
    c1 = c2;
    c2 = c3;
  }
  return s;
}

/// Owen's nested uniform scrambling: whether a bit flips depends on `seed` and on the bits above it.
/// Source: Laine and Karras 2011, Burley 2020; constants of Vegdahl 2021.
LC_FN std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  x = reverse_bits(x);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}

/// Stream `index` of those that `seed` names. Stateless: `draw(k)` is the k-th group of four numbers, the same in any
/// order, on any thread and on any device.
///
/// Of a low-discrepancy stream, group k of the streams 0, 1, 2, ... is a four-dimensional Sobol sequence with an Owen
/// scrambling and an order of its own (Burley 2020, section 5), so each group is well spread and groups do not correlate.
struct SampleStream {
  std::uint64_t seed = 0;
  std::uint32_t index = 0;
  bool low_discrepancy = true;

  [[nodiscard]] LC_KERNEL Sample4 draw(std::uint32_t group) const {
    if (!low_discrepancy) return philox(index, group, 0x6c696768u, seed);
    const std::uint32_t key =
        combine_bits(combine_bits(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)), group);
    Sample4 s = sobol4(owen_scramble(index, key));
    for (std::uint32_t d = 0; d < 4; ++d) s.bits[d] = owen_scramble(s.bits[d], combine_bits(key, d + 1));
    return s;
  }
};

/// A seed for a purpose of its own (the pilot, the primary samples, a pixel): its streams share nothing with `seed`'s.
LC_FN std::uint64_t derive_seed(std::uint64_t seed, std::uint64_t purpose) {
  const Sample4 s =
      philox(static_cast<std::uint32_t>(purpose), static_cast<std::uint32_t>(purpose >> 32), 0x73656564u, seed);
  return (std::uint64_t{s.bits[0]} << 32) | s.bits[1];
}

}  // namespace lightcuts
