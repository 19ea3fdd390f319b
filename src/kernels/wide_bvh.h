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

/// Node with up to eight children whose boxes are stored in 8 bits a plane: 80 bytes, five 16-byte loads, each of which
/// holds something that traversal needs first.
///
/// Box of child c along an axis: origin + scale * [lo[c], hi[c]], scale = 2^exponent, rounded outwards. A child is a
/// node (bit c of node_mask, numbered from child_base in the order of its bits), up to three triangles (bits 3 c to 3 c + 2 of
/// triangle_mask, numbered from triangle_base in the order of the bits), or nothing.
/// Layout after Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs".
struct alignas(16) WideNode {
  Vec3 origin;
  std::int8_t exponent_x, exponent_y, exponent_z;
  std::uint8_t node_mask;
  std::uint32_t child_base, triangle_base;
  std::uint8_t lo_x[8], lo_y[8], lo_z[8];
  std::uint32_t triangle_mask;
  float byte_float;  ///< kByteFloat, for traversal
  std::uint8_t hi_x[8], hi_y[8], hi_z[8];
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
  /// The same nodes in another order, for rays that ask whether there is any hit: children that are nodes have the first
  /// slots, in the order of the chance that a ray ends there for what it costs to look.
  const WideNode* shadow_nodes = nullptr;
  const LeafTriangle* triangles = nullptr;
};

/// 2^e as a float, for -126 <= e <= 127.
LC_FN float exp2_int(int e) { return float_of(static_cast<std::uint32_t>(e + 127) << 23); }

/// Reciprocal, one unit in the last place off at most; it stays finite, so that 0 * inverse is never NaN.
LC_FN float safe_inverse(float v) {
  constexpr float tiny = 1e-20f;
  const float magnitude = v < 0 ? -v : v;
  const float divisor = magnitude > tiny ? v : (bits_of(v) >> 31 ? -tiny : tiny);
#if defined(__CUDA_ARCH__)
  float inverse;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(inverse) : "f"(divisor));
  return inverse;
#else
  return 1.0f / divisor;
#endif
}
LC_FN Vec3 safe_inverse(Vec3 v) { return {safe_inverse(v.x), safe_inverse(v.y), safe_inverse(v.z)}; }

/// Each of eight bits three times.
LC_FN std::uint32_t triple_bits(std::uint32_t bits) {
  const std::uint32_t nibbles = bits * 0x101u & 0x00f00fu, pairs = nibbles * 0x11u & 0x0c30c3u;
  return (pairs * 5u & 0x249249u) * 7u;
}

/// What lies in memory, in registers: on a GPU by loads of 16 bytes.
template <int count>
struct Words {
  std::uint32_t word[count];
};
template <class T>
LC_KERNEL Words<sizeof(T) / 4> read_words(const T* from) {
  Words<sizeof(T) / 4> words;
#if defined(__CUDA_ARCH__)
  static_assert(sizeof(T) % 16 == 0 && alignof(T) % 16 == 0);
#pragma unroll
  for (int i = 0; i < static_cast<int>(sizeof(T)) / 16; ++i) {
    const uint4 four = __ldg(reinterpret_cast<const uint4*>(from) + i);
    words.word[4 * i] = four.x;
    words.word[4 * i + 1] = four.y;
    words.word[4 * i + 2] = four.z;
    words.word[4 * i + 3] = four.w;
  }
#else
  __builtin_memcpy(&words, from, sizeof(T));
#endif
  return words;
}

/// A node as traversal reads it.
struct NodeWords : Words<sizeof(WideNode) / 4> {
  LC_FN Vec3 origin() const { return {float_of(word[0]), float_of(word[1]), float_of(word[2])}; }
  LC_FN int exponent(int axis) const { return static_cast<std::int8_t>(word[3] >> 8 * axis & 0xffu); }
  LC_FN std::uint32_t node_mask() const { return word[3] >> 24; }
  LC_FN std::uint32_t child_base() const { return word[4]; }
  LC_FN std::uint32_t triangle_base() const { return word[5]; }
  LC_FN std::uint32_t triangle_mask() const { return word[12]; }
  LC_FN std::uint32_t byte_bits() const { return word[13]; }
  LC_FN std::uint32_t lo(int axis, int half) const { return word[6 + 2 * axis + half]; }
  LC_FN std::uint32_t hi(int axis, int half) const { return word[14 + 2 * axis + half]; }
};

/// A ray's distances to a node's quantised planes of one axis: q-th plane, q added to kByteFloat, at scale * q + offset.
struct PlaneDistances {
  // A far end six parts in 2^23 late makes up for the rounding of distances (Ize 2013) and reciprocals; near by, the boxes'
  // own padding does.
  static constexpr float kLate = 1.0f + 7.2e-7f;
  float near_scale, far_scale, near_offset = 0, far_offset = 0;
  bool backwards;
  std::uint32_t byte_bits;

  LC_FN PlaneDistances(const NodeWords& node, int axis, float node_origin, float origin, float inverse)
      : near_scale(exp2_int(node.exponent(axis)) * inverse),
        far_scale(near_scale * kLate),
        backwards(inverse < 0),
        byte_bits(node.byte_bits()) {
    const float first = (node_origin - origin) * inverse;
    near_offset = multiply_add(-kByteFloat, near_scale, first);
    far_offset = multiply_add(-kByteFloat, far_scale, first * kLate);
  }
  LC_FN std::int32_t near(std::uint32_t lo, std::uint32_t hi, int k) const {
    return static_cast<std::int32_t>(
        bits_of(multiply_add(byte_float(backwards ? hi : lo, k, byte_bits), near_scale, near_offset)));
  }
  LC_FN std::int32_t far(std::uint32_t lo, std::uint32_t hi, int k) const {
    return static_cast<std::int32_t>(
        bits_of(multiply_add(byte_float(backwards ? lo : hi, k, byte_bits), far_scale, far_offset)));
  }
};

/// Which children's boxes the ray meets within [0, t_max]; errs on the side of meeting.
LC_FN std::uint32_t intersect_children(const NodeWords& node, Vec3 origin, Vec3 inverse, float t_max) {
  const Vec3 from = node.origin();
  const PlaneDistances x(node, 0, from.x, origin.x, inverse.x), y(node, 1, from.y, origin.y, inverse.y),
      z(node, 2, from.z, origin.z, inverse.z);
  const auto end = static_cast<std::int32_t>(bits_of(t_max * PlaneDistances::kLate));
  std::uint32_t missed = 0;
#if defined(__CUDA_ARCH__)
#pragma unroll
#endif
  for (int c = 7; c >= 0; --c) {
    const int half = c / 4, k = c % 4;
    const std::int32_t near =
        max3_or_zero(x.near(node.lo(0, half), node.hi(0, half), k), y.near(node.lo(1, half), node.hi(1, half), k),
                     z.near(node.lo(2, half), node.hi(2, half), k));
    const std::int32_t far =
        min4(x.far(node.lo(0, half), node.hi(0, half), k), y.far(node.lo(1, half), node.hi(1, half), k),
             z.far(node.lo(2, half), node.hi(2, half), k), end);
    missed = push_sign(missed, float_of(static_cast<std::uint32_t>(far)) - float_of(static_cast<std::uint32_t>(near)));
  }
  return ~missed & 0xffu;
}

/// Accepts every triangle: for scenes without alpha masks.
struct AcceptAll {
  LC_FN bool operator()(const LeafTriangle&, const TriangleHit&) const { return true; }
};

/// The children of one node that a ray has still to visit, and where they begin.
struct NodeGroup {
  std::uint32_t base;
  std::uint32_t slots;  ///< those met, in visiting order; for the nearest hit with the node mask << 8
};

/// One ray's way through the tree, a node at a time. `any_hit` ends at the first triangle; else the nearest is found.
/// The stack of kTraversalStack groups is the caller's: what is indexed at run time would keep the rest from registers.
template <bool any_hit>
class TreeWalk {
 public:
  Hit best;

  /// The ray's t_min must not be negative; `bvh` must hold something.
  LC_KERNEL explicit TreeWalk(const Ray& ray)
      : ray_(ray),
        inverse_(safe_inverse(ray.direction)),
        sheared_(shear(ray.direction)),
        octant_(any_hit ? 0 : (inverse_.x < 0 ? 1u : 0u) | (inverse_.y < 0 ? 2u : 0u) | (inverse_.z < 0 ? 4u : 0u)),
        group_{0, (any_hit ? 0 : 1u << 8) | 1u << octant_} {
    best.t = ray.t_max;
  }

  /// Visits the next node; false: there is nothing more to find. Triangles with an alpha mask are shown to `accept` first.
  template <class Accept>
  LC_KERNEL bool step(const WideBvhView& bvh, NodeGroup* stack, const Accept& accept) {
    if ((group_.slots & 0xffu) == 0) {
      if (depth_ == 0) return false;
      group_ = stack[--depth_];
    }
    // Take the first met child of the group, put the rest back.
    const std::uint32_t index = group_.base + first_child();
    group_.slots &= group_.slots - 1;
    if ((group_.slots & 0xffu) != 0) stack[depth_++] = group_;

    const NodeWords node{read_words((any_hit ? bvh.shadow_nodes : bvh.nodes) + index)};
    const std::uint32_t met = intersect_children(node, ray_.origin, inverse_, best.t);
    const std::uint32_t triangles = node.triangle_mask(), triangle_base = node.triangle_base();
    const std::uint32_t inner = met & node.node_mask();
    // All triangles of the leaves met in one row: lanes of a warp that have few do not wait at each leaf.
    for (std::uint32_t left = triple_bits(met) & triangles; left != 0; left &= left - 1) {
      const std::uint32_t before = triangles & (lowest_set(left) - 1);
      const std::uint32_t at = triangle_base + static_cast<std::uint32_t>(count_bits(before));
      if (test(__builtin_bit_cast(LeafTriangle, read_words(bvh.triangles + at)), accept) && any_hit) return false;
    }
    group_.base = node.child_base();
    if constexpr (any_hit) {
      group_.slots = inner;
    } else {
      group_.slots = node.node_mask() << 8;
      for (std::uint32_t left = inner; left != 0; left &= left - 1) {
        group_.slots |= 1u << (static_cast<std::uint32_t>(lowest_bit(left)) ^ octant_);
      }
    }
    return true;
  }

 private:
  /// Which of its node's children the group's first one is.
  LC_KERNEL std::uint32_t first_child() const {
    const auto first = static_cast<std::uint32_t>(lowest_bit(group_.slots));
    if constexpr (any_hit) return first;
    return static_cast<std::uint32_t>(count_bits((group_.slots >> 8) & ((1u << (first ^ octant_)) - 1)));
  }
  LC_FN static std::uint32_t lowest_set(std::uint32_t bits) { return bits & (~bits + 1); }

  /// Whether the ray meets the triangle, nearer than the best so far; among equal distances the lower (instance, triangle).
  template <class Accept>
  LC_KERNEL bool test(const LeafTriangle& triangle, const Accept& accept) {
    const TriangleMeeting meeting =
        meet_triangle(ray_.origin, sheared_, triangle.p0, triangle.p1, triangle.p2, ray_.t_min, best.t);
    if (meeting.t < 0 || (triangle.masked != 0 && !accept(triangle, meeting.hit()))) return false;
    if constexpr (!any_hit) {
      const bool nearer = meeting.t < best.t || best.instance == kNone || triangle.instance < best.instance ||
                          (triangle.instance == best.instance && triangle.triangle < best.triangle);
      if (!nearer) return false;
    }
    const TriangleHit hit = meeting.hit();
    best = {hit.t, hit.u, hit.v, triangle.instance, triangle.triangle};
    return true;
  }

  Ray ray_;
  Vec3 inverse_;
  ShearedRay sheared_;
  std::uint32_t octant_;
  NodeGroup group_;
  int depth_ = 0;
};

/// Walks the tree to the nearest hit, or to any. The result is the same whatever the order of the walk.
template <bool any_hit, class Accept>
LC_KERNEL Hit traverse(WideBvhView bvh, const Ray& ray, const Accept& accept) {
  TreeWalk<any_hit> walk(ray);
  if (bvh.nodes == nullptr) return walk.best;
  NodeGroup stack[kTraversalStack];
  while (walk.step(bvh, stack, accept)) {
  }
  return walk.best;
}

}  // namespace lightcuts
