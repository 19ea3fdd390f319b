#pragma once

// Only for files that are compiled once for each instruction set; see lanes.h.
#include "backend/light_tree.h"
#include "cpu/cut/bound_lanes.h"
#include "kernels/group_bound.h"

namespace lightcuts::LC_ISA {

using BoundVec3 = Vec3T<BoundLanes>;

/// Nodes of a light tree, one a lane.
struct NodeLanes {
  ClusterBounds<BoundLanes> bounds;
  BoundVec3 intensity;
};

static_assert(sizeof(LightNode) == 16 * sizeof(float));

#if defined(__SSE2__)

/// Four floats of each of as many nodes as a register has groups of four lanes: nodes 0, 4, 8, 12 from `first` on.
LC_LANES_FN Batch load_fours(const float* const* node, int first, int offset) {
#if defined(__AVX512F__)
  __m512 row = _mm512_castps128_ps512(_mm_load_ps(node[first] + offset));
  row = _mm512_insertf32x4(row, _mm_load_ps(node[first + 4] + offset), 1);
  row = _mm512_insertf32x4(row, _mm_load_ps(node[first + 8] + offset), 2);
  return _mm512_insertf32x4(row, _mm_load_ps(node[first + 12] + offset), 3);
#elif defined(__AVX__)
  const __m256 row = _mm256_castps128_ps256(_mm_load_ps(node[first] + offset));
  return _mm256_insertf128_ps(row, _mm_load_ps(node[first + 4] + offset), 1);
#else
  return _mm_load_ps(node[first] + offset);
#endif
}

struct FourBatches {
  Batch a, b, c, d;
};

/// Transposes 4x4 floats within every four lanes.
LC_LANES_FN FourBatches transpose_fours(Batch p, Batch q, Batch r, Batch s) {
#if defined(__AVX512F__)
  const __m512 t0 = _mm512_unpacklo_ps(p, q), t1 = _mm512_unpackhi_ps(p, q);
  const __m512 t2 = _mm512_unpacklo_ps(r, s), t3 = _mm512_unpackhi_ps(r, s);
  return {_mm512_shuffle_ps(t0, t2, 0x44), _mm512_shuffle_ps(t0, t2, 0xee), _mm512_shuffle_ps(t1, t3, 0x44),
          _mm512_shuffle_ps(t1, t3, 0xee)};
#elif defined(__AVX__)
  const __m256 t0 = _mm256_unpacklo_ps(p, q), t1 = _mm256_unpackhi_ps(p, q);
  const __m256 t2 = _mm256_unpacklo_ps(r, s), t3 = _mm256_unpackhi_ps(r, s);
  return {_mm256_shuffle_ps(t0, t2, 0x44), _mm256_shuffle_ps(t0, t2, 0xee), _mm256_shuffle_ps(t1, t3, 0x44),
          _mm256_shuffle_ps(t1, t3, 0xee)};
#else
  const __m128 t0 = _mm_unpacklo_ps(p, q), t1 = _mm_unpackhi_ps(p, q);
  const __m128 t2 = _mm_unpacklo_ps(r, s), t3 = _mm_unpackhi_ps(r, s);
  return {_mm_movelh_ps(t0, t2), _mm_movehl_ps(t2, t0), _mm_movelh_ps(t1, t3), _mm_movehl_ps(t3, t1)};
#endif
}

/// Floats 4 k to 4 k + 3 of every node.
LC_LANES_FN FourBatches load_block(const float* const* node, int k) {
  return transpose_fours(load_fours(node, 0, 4 * k), load_fours(node, 1, 4 * k), load_fours(node, 2, 4 * k),
                         load_fours(node, 3, 4 * k));
}

#else

struct FourBatches {
  Batch a, b, c, d;
};

LC_LANES_FN Batch load_column(const float* const* node, int k) {
  alignas(64) float column[Lanes::kCount];
  for (int i = 0; i < Lanes::kCount; ++i) __builtin_memcpy(&column[i], node[i] + k, sizeof(float));
  return Batch::load_aligned(column);
}

LC_LANES_FN FourBatches load_block(const float* const* node, int k) {
  return {load_column(node, 4 * k), load_column(node, 4 * k + 1), load_column(node, 4 * k + 2),
          load_column(node, 4 * k + 3)};
}

#endif

/// Nodes from memory into lanes. What is no float in a node is moved, never computed with.
LC_LANES_FN NodeLanes load_nodes(const float* const* node) {
  const FourBatches p = load_block(node, 0), q = load_block(node, 1), r = load_block(node, 2), s = load_block(node, 3);
  return {{{p.a, p.b, p.c}, {p.d, q.a, q.b}, {q.c, q.d, r.a}, r.b}, {r.c, r.d, s.a}};
}

/// The same: of every pair both, side by side.
LC_LANES_FN NodeLanes load_pairs(const LightNode* const* pairs) {
  const float* node[Lanes::kCount];
  for (int i = 0; i < Lanes::kCount; ++i) node[i] = reinterpret_cast<const float*>(&pairs[i / 2][i % 2]);
  return load_nodes(node);
}

}  // namespace lightcuts::LC_ISA
