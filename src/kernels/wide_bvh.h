#pragma once

#include <cstdint>

#include "kernels/bits.h"
#include "kernels/scene_view.h"
#include "kernels/triangle.h"

namespace lightcuts {

/// Triangles a leaf slot holds at most.
inline constexpr int kLeafTriangles = 3;
/// Nodes below which an empty or finished stack is told; deeper than any tree over 2^32 triangles gets.
inline constexpr int kTraversalStack = 48;

/// Node with up to eight children whose boxes are stored in 8 bits a plane: 80 bytes, five 16-byte loads.
///
/// Box of child c along an axis: origin + scale * [lo[c], hi[c]], scale = 2^exponent, rounded outwards. A child is a
/// node (bit c of node_mask, numbered from child_base in the order of its bits) or up to three triangles:
/// meta[c] = first << 2 | count counted from triangle_base; 0: empty.
/// Layout after Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs".
struct alignas(16) WideNode {
  Vec3 origin;
  std::int8_t exponent_x, exponent_y, exponent_z;
  std::uint8_t node_mask;
  std::uint32_t child_base, triangle_base;
  std::uint8_t meta[8];
  std::uint8_t lo_x[8], lo_y[8], lo_z[8], hi_x[8], hi_y[8], hi_z[8];
};
static_assert(sizeof(WideNode) == 80);

/// A triangle where traversal meets it: 48 bytes, three 16-byte loads.
struct alignas(16) LeafTriangle {
  Vec3 p0;
  std::uint32_t instance;
  Vec3 p1;
  std::uint32_t triangle;
  Vec3 p2;
  std::uint32_t masked;  ///< 1: the material has an alpha mask, ask before accepting
};
static_assert(sizeof(LeafTriangle) == 48);

struct WideBvhView {
  const WideNode* nodes = nullptr;  ///< node 0 is the root; nullptr: nothing to hit
  const LeafTriangle* triangles = nullptr;
};

/// 2^e as a float, for -126 <= e <= 127.
LC_FN float exp2_int(int e) { return float_of(static_cast<std::uint32_t>(e + 127) << 23); }

/// Reciprocal that stays finite, so that 0 * inverse is never NaN.
LC_FN float safe_inverse(float v) {
  constexpr float tiny = 1e-20f;
  const float magnitude = v < 0 ? -v : v;
  return 1.0f / (magnitude > tiny ? v : (bits_of(v) >> 31 ? -tiny : tiny));
}

/// a b + c rounded once where that is one operation, whatever the compiler is told: what only bounds may round as it likes.
LC_FN float multiply_add(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
  return __fmaf_rn(a, b, c);
#else
  return a * b + c;
#endif
}

/// Which children's boxes the ray meets within [t_min, t_max]; errs on the side of meeting.
LC_FN std::uint32_t intersect_children(const WideNode& node, Vec3 origin, Vec3 inverse, float t_min, float t_max) {
  // A far end one part in 2^21 late makes up for the rounding of distances (Ize 2013); near by, the boxes' own padding does.
  constexpr float late = 1.0f + 4.8e-7f;
  const float sx = exp2_int(node.exponent_x) * inverse.x, sy = exp2_int(node.exponent_y) * inverse.y,
              sz = exp2_int(node.exponent_z) * inverse.z;
  const float bx = (node.origin.x - origin.x) * inverse.x, by = (node.origin.y - origin.y) * inverse.y,
              bz = (node.origin.z - origin.z) * inverse.z;
  std::uint32_t met = 0;
  for (int c = 0; c < 8; ++c) {
    const float x0 = static_cast<float>(inverse.x < 0 ? node.hi_x[c] : node.lo_x[c]);
    const float x1 = static_cast<float>(inverse.x < 0 ? node.lo_x[c] : node.hi_x[c]);
    const float y0 = static_cast<float>(inverse.y < 0 ? node.hi_y[c] : node.lo_y[c]);
    const float y1 = static_cast<float>(inverse.y < 0 ? node.lo_y[c] : node.hi_y[c]);
    const float z0 = static_cast<float>(inverse.z < 0 ? node.hi_z[c] : node.lo_z[c]);
    const float z1 = static_cast<float>(inverse.z < 0 ? node.lo_z[c] : node.hi_z[c]);
    const float near =
        max_of(max_of(multiply_add(x0, sx, bx), multiply_add(y0, sy, by)), max_of(multiply_add(z0, sz, bz), t_min));
    const float far =
        min_of(min_of(multiply_add(x1, sx, bx), multiply_add(y1, sy, by)), min_of(multiply_add(z1, sz, bz), t_max));
    if (near <= far * late) met |= 1u << c;
  }
  return met;
}

/// Accepts every triangle: for scenes without alpha masks.
struct AcceptAll {
  LC_FN bool operator()(const LeafTriangle&, const TriangleHit&) const { return true; }
};

/// Walks the tree. `any_hit` ends at the first triangle; else the nearest is found. Triangles with an alpha mask are
/// shown to `accept` first.
///
/// The result is the same whatever the order of the walk: among equal distances the lower (instance, triangle) wins.
template <bool any_hit, class Accept>
LC_KERNEL Hit traverse(const WideBvhView& bvh, const Ray& ray, const Accept& accept) {
  Hit best;
  best.t = ray.t_max;
  if (bvh.nodes == nullptr) return best;
  const Vec3 inverse{safe_inverse(ray.direction.x), safe_inverse(ray.direction.y), safe_inverse(ray.direction.z)};
  const ShearedRay sheared = shear(ray.direction);
  const std::uint32_t octant = (inverse.x < 0 ? 1u : 0u) | (inverse.y < 0 ? 2u : 0u) | (inverse.z < 0 ? 4u : 0u);

  // A group is the children of one node still to visit: where they begin, which slots are nodes, which were met.
  struct Group {
    std::uint32_t base, slots;  // slots: node mask << 8 | met, met in visiting order
  };
  Group stack[kTraversalStack];
  int depth = 0;
  Group group{0, 1u << 8 | 1u << (0 ^ octant)};
  for (;;) {
    if ((group.slots & 0xffu) == 0) {
      if (depth == 0) return best;
      group = stack[--depth];
    }
    // Take the nearest met child of the group, put the rest back.
    const int visit = lowest_bit(group.slots & 0xffu);
    group.slots &= ~(1u << visit);
    const std::uint32_t slot = static_cast<std::uint32_t>(visit) ^ octant;
    const std::uint32_t node_mask = group.slots >> 8;
    const std::uint32_t index = group.base + static_cast<std::uint32_t>(count_bits(node_mask & ((1u << slot) - 1)));
    if ((group.slots & 0xffu) != 0) stack[depth++] = group;

    const WideNode& node = bvh.nodes[index];
    const std::uint32_t met = intersect_children(node, ray.origin, inverse, ray.t_min, best.t);
    std::uint32_t leaves = met & ~static_cast<std::uint32_t>(node.node_mask);
    while (leaves != 0) {
      const int leaf = lowest_bit(leaves);
      leaves &= leaves - 1;
      const std::uint32_t first = node.triangle_base + (node.meta[leaf] >> 2);
      const std::uint32_t count = node.meta[leaf] & 3u;
      for (std::uint32_t i = first; i < first + count; ++i) {
        const LeafTriangle& triangle = bvh.triangles[i];
        const TriangleHit hit =
            intersect_triangle(ray.origin, sheared, triangle.p0, triangle.p1, triangle.p2, ray.t_min, best.t);
        if (hit.t < 0 || (triangle.masked && !accept(triangle, hit))) continue;
        const bool nearer = hit.t < best.t || best.instance == kNone || triangle.instance < best.instance ||
                            (triangle.instance == best.instance && triangle.triangle < best.triangle);
        if (!nearer) continue;
        best = {hit.t, hit.u, hit.v, triangle.instance, triangle.triangle};
        if constexpr (any_hit) return best;
      }
    }
    std::uint32_t inner = met & node.node_mask;
    group = {node.child_base, static_cast<std::uint32_t>(node.node_mask) << 8};
    while (inner != 0) {
      const int c = lowest_bit(inner);
      inner &= inner - 1;
      group.slots |= 1u << (static_cast<std::uint32_t>(c) ^ octant);
    }
  }
}

}  // namespace lightcuts
