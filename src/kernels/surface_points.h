#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/light_key.h"
#include "kernels/scene_view.h"
#include "kernels/shadow_map.h"
#include "kernels/surface.h"
#include "math/sample_stream.h"

namespace lightcuts {

// How the points that shadow maps are drawn from lie on the surfaces of a scene, one point at a time: the text that the
// CPU and the GPU run.

struct PlacedTriangle {
  std::uint32_t instance, triangle;
};

/// A triangle's place along a space-filling curve: neighbours in the order of this key are neighbours in the scene.
LC_KERNEL std::uint64_t triangle_key(const SceneView& scene, PlacedTriangle t) {
  const TriangleGeometry g = triangle_geometry(scene, t.instance, t.triangle);
  const Vec3 middle = g.p0 + (g.e1 + g.e2) * (1.0f / 3.0f);
  // Sides that face apart first: both faces of a thin board get points of their own.
  return light_key(middle, g.front, scene.bounds, {16, 1, 0});
}

/// Sorting hundreds of millions of instanced triangles would take too much memory: beyond this many they stay in the
/// scene's order.
inline constexpr std::uint64_t kMostSortedTriangles = 1u << 24;

/// The area before every 16th triangle of the order is stored: what a search by area starts with. Sums of each triangle
/// would take much more memory.
inline constexpr std::uint64_t kAreaChunk = 16;

/// How many points a scene has, for maps of `per_map` points: enough that maps differ, not more than a map needs many
/// times over.
LC_FN std::uint64_t surface_point_count(std::uint64_t per_map) {
  return max_of<std::uint64_t>(per_map, clamp_to<std::uint64_t>(16 * per_map, 1u << 16, 1u << 21));
}

/// The stream that points are drawn from, and how many draws at most: where almost everything is cut away, fewer points
/// have to do.
LC_KERNEL std::uint32_t point_stream(std::uint64_t seed) {
  return static_cast<std::uint32_t>(derive_seed(seed, 0x69736d));
}
LC_FN std::uint64_t most_point_draws(std::uint64_t wanted) { return 16 * wanted; }
/// Draws a round: all of one are made before those that masks cut away are left out.
LC_FN std::uint64_t point_round(std::uint64_t wanted) { return min_of<std::uint64_t>(wanted, 1u << 16); }

/// Place in a triangle for a number in [0, 1): a quarter of it names a quarter of the triangle, and so on.
/// The result weighs corners 1 and 2. Source: Basu and Owen 2015, section 3.
LC_KERNEL Vec2 subdivide(double number) {
  Vec2 a{0, 0}, b{1, 0}, c{0, 1};
  for (int depth = 0; depth < 12; ++depth) {
    number *= 4;
    const int quarter = min_of(3, static_cast<int>(number));
    number -= quarter;
    const Vec2 ab = (a + b) * 0.5f, bc = (b + c) * 0.5f, ca = (c + a) * 0.5f;
    if (quarter == 0) {
      a = bc, b = ca, c = ab;
    } else if (quarter == 1) {
      b = ab, c = ca;
    } else if (quarter == 2) {
      a = ab, c = bc;
    } else {
      a = ca, b = bc;
    }
  }
  return (a + b + c) * (1.0f / 3.0f);
}

struct DrawnPoint {
  Vec3 position, normal;
  std::uint32_t instance = kNone, triangle = 0;  ///< kNone: cut away
};

/// The triangles in an order, and sums of their areas.
/// `order(i)` names triangle i; chunk c begins with triangle kAreaChunk * c, and `area_before[c]` [m^2] lies before it.
template <class Order>
struct AreaTable {
  Order order;
  std::uint64_t triangle_count;
  const double* area_before;
  std::uint64_t chunk_count;
  double area;  ///< of all
};

/// The last chunk that begins at or before `at` [m^2].
template <class Order>
LC_KERNEL std::uint64_t find_chunk(const AreaTable<Order>& table, double at) {
  std::uint64_t first = 0, count = table.chunk_count;  // the first chunk that begins after `at` is within them
  while (count > 0) {
    const std::uint64_t half = count / 2;
    if (table.area_before[first + half] <= at) {
      first += half + 1;
      count -= half + 1;
    } else {
      count = half;
    }
  }
  return first - 1;
}

/// Point `index` of the sequence: a scrambled van der Corput number of the total area names a triangle, and the rest of
/// the number a place in it.
template <class Order>
LC_KERNEL DrawnPoint draw_point(const SceneView& scene, const AreaTable<Order>& table, std::uint32_t index,
                                std::uint32_t stream) {
  // 32 bits are few for a tiny triangle's inside: random ones follow.
  const std::uint64_t high = owen_scramble(reverse_bits(index), stream), low = combine_bits(index, stream);
  const double at = static_cast<double>((high << 32 | low) >> 11) * 0x1p-53 * table.area;
  const std::uint64_t chunk = find_chunk(table, at);
  double rest = at - table.area_before[chunk];
  TriangleGeometry g{};
  PlacedTriangle found = table.order(chunk * kAreaChunk);
  const std::uint64_t end = min_of(table.triangle_count, (chunk + 1) * kAreaChunk);
  for (std::uint64_t i = chunk * kAreaChunk; i < end; ++i) {
    const PlacedTriangle t = table.order(i);
    const TriangleGeometry candidate = triangle_geometry(scene, t.instance, t.triangle);
    if (!(candidate.area > 0)) continue;
    g = candidate;
    found = t;
    if (rest < g.area) break;
    rest -= g.area;
  }
  const double share = g.area > 0 ? clamp_to(rest / g.area, 0.0, 1.0) : 0.0;
  const Vec2 weight = subdivide(share);
  DrawnPoint point{g.p0 + g.e1 * weight.x + g.e2 * weight.y, g.front, found.instance, found.triangle};
  const MeshView& mesh = scene.meshes[scene.instances[found.instance].mesh];
  if (cut_away(scene, mesh, found.triangle, weight.x, weight.y)) point.instance = kNone;
  return point;
}

/// Radius of a circle with the area that a point of a map stands for [m].
LC_KERNEL float point_radius(double area, std::uint32_t per_map) {
  return static_cast<float>(std::sqrt(area / static_cast<double>(per_map) / 3.14159265358979));
}

// --- The shape of a point's disc ---

/// See MeshEdges in backend/hard_edges.h.
struct MeshEdgesView {
  const std::uint8_t* hard = nullptr;   ///< a byte a triangle
  const std::uint32_t* next = nullptr;  ///< three neighbours a triangle
};

/// Bits of MeshEdges::hard: an edge has no neighbour at all; the triangle belongs to a closed body that it faces out of.
inline constexpr std::uint8_t kOpenEdge = 64, kSolid = 128;

/// Triangles that bend by less than 0.8 degrees are one flat face.
inline constexpr float kFlatCosine = 0.9999f;

/// A disc reaches over a curved surface until that has fallen below its plane by this share of the way: by a half of the
/// radius of curvature.
inline constexpr float kSteepest = 0.25f;
/// The same for discs of triangles that are as wide as the disc: their neighbours have points enough of their own.
inline constexpr float kSteepestFromWide = 0.05f;
/// Where the surface rises above the disc's plane, this part of it: there the disc comes out of what is thin.
inline constexpr float kRiseOfFall = 0.4f;
/// What turns away from the disc by more than this cosine is another side of the body.
inline constexpr float kSameSide = 0.6f;
/// Triangles that a walk over the surface crosses at most: where they are finer, the disc is taken to be whole.
inline constexpr int kMostSteps = 32;

/// The part of a surface that stands for a point of one of its triangles: the triangle and those that go on from it in its
/// plane, as far as discs are cut by their edges, and what curvature leaves of a disc.
struct DiscFace {
  DiscShape shape;
  int edge_count = 0;
  float area = 0;
  float sink = 0;     ///< see pack_sink
  bool open = false;  ///< some edge has no neighbour
};

LC_KERNEL void add_edge(DiscFace& face, Vec3 inward, float offset) {
  for (int e = 0; e < face.edge_count; ++e) {
    if (dot(face.shape.inward[e], inward) < kFlatCosine) continue;
    face.shape.offset[e] = max_of(face.shape.offset[e], offset);
    return;
  }
  if (face.edge_count == kDiscEdges) return;
  face.shape.inward[face.edge_count] = inward;
  face.shape.offset[face.edge_count++] = offset;
}

/// A triangle as seen from one of its edges: `inward` unit in its plane, `height` of the corner that faces the edge [m].
struct EdgeFrame {
  Vec3 start, along, inward;
  float height = 0;
};
LC_KERNEL EdgeFrame edge_frame(Vec3 a, Vec3 b, Vec3 corner) {
  const Vec3 along = b - a, to = corner - a;
  const Vec3 away = to - along * (dot(to, along) / length_sq(along));
  const float height = length(away);
  return {a, along, height > 0 ? away / height : Vec3{}, height > 0 ? height : 0};
}
LC_KERNEL EdgeFrame edge_frame(const TriangleGeometry& g, int edge) {
  const Vec3 corner[3] = {g.p0, g.p0 + g.e1, g.p0 + g.e2};
  return edge_frame(corner[edge], corner[(edge + 1) % 3], corner[(edge + 2) % 3]);
}

/// Adds the hard edges of a triangle of the face. Where the face is not convex, the line of a neighbour's edge may run
/// through the point's own triangle: that one cuts nothing.
LC_KERNEL void add_hard_edges(const TriangleGeometry& g, std::uint32_t hard, const TriangleGeometry& own,
                              DiscFace& face) {
  for (int e = 0; e < 3; ++e) {
    if ((hard >> e & 1u) == 0) continue;
    const EdgeFrame edge = edge_frame(g, e);
    if (!(edge.height > 0)) continue;
    const Vec3 a = edge.start, inward = edge.inward;
    const float slack = 1e-3f * edge.height;
    const float own_least =
        min_of(dot(own.p0 - a, inward), min_of(dot(own.p0 + own.e1 - a, inward), dot(own.p0 + own.e2 - a, inward)));
    if (own_least < -slack) continue;
    add_edge(face, inward, dot(inward, a));
  }
}

/// How far the surface goes on beyond an edge of a triangle near its plane.
struct SurfaceReach {
  float reach = 0, height = 0;  ///< beyond the edge, and over the plane there [m]
  float fall = 0, rise = 0;     ///< how far the surface goes below and above the plane on the way [m]
  int steps = 0;                ///< triangles crossed
  bool ends = false;            ///< before the disc's radius, and then where:
  Vec3 inward;
  float offset = 0;

  LC_FN void go_to(float far, float high) {
    reach = far;
    height = high;
    fall = max_of(fall, -high);
    rise = max_of(rise, high);
  }
};

LC_KERNEL float least_inside(const TriangleGeometry& own, Vec3 inward) {
  return min_of(dot(own.p0, inward), min_of(dot(own.p0 + own.e1, inward), dot(own.p0 + own.e2, inward)));
}

/// Lets a walk end at an edge from a to b, or across its way where that would cut the triangle it began in.
LC_KERNEL void end_at(SurfaceReach& walk, const TriangleGeometry& own, const EdgeFrame& start, Vec3 a, Vec3 b) {
  walk.ends = true;
  walk.inward = start.inward;
  walk.offset = dot(start.inward, start.start) - walk.reach;
  const Vec3 across = cross(b - a, own.front);
  const float len = length(across);
  if (!(len > 0)) return;
  const Vec3 inward = across * ((dot(across, start.inward) < 0 ? -1.0f : 1.0f) / len);
  const float offset = dot(inward, a);
  if (least_inside(own, inward) < offset - 1e-3f * start.height) return;
  walk.inward = inward;
  walk.offset = offset;
}

/// The edge of `triangle` beyond which `neighbour` lies; 3 if there is none.
LC_KERNEL int edge_towards(const MeshEdgesView& edges, std::uint32_t triangle, std::uint32_t neighbour) {
  int edge = 0;
  while (edge < 3 && edges.next[3 * std::size_t{triangle} + static_cast<std::size_t>(edge)] != neighbour) ++edge;
  return edge;
}

/// Walks over the surface from the middle of a triangle's edge, straight away from it, as far as `radius`.
LC_KERNEL SurfaceReach walk_from(const SceneView& scene, const MeshEdgesView& edges, std::uint32_t instance,
                                 std::uint32_t triangle, const TriangleGeometry& own, int edge, float radius) {
  const EdgeFrame start = edge_frame(own, edge);
  const float steepest = start.height > radius ? kSteepestFromWide : kSteepest;
  Vec3 a = start.start, b = edge == 0 ? own.p0 + own.e1 : edge == 1 ? own.p0 + own.e2 : own.p0;
  const Vec3 from = (a + b) * 0.5f, across = cross(own.front, start.inward);
  SurfaceReach walk;
  for (; walk.steps < kMostSteps && walk.reach < radius; ++walk.steps) {
    if ((edges.hard[triangle] >> edge & 1u) != 0) {
      end_at(walk, own, start, a, b);
      return walk;
    }
    const std::uint32_t next = edges.next[3 * std::size_t{triangle} + static_cast<std::size_t>(edge)];
    if (next == kNone) return walk;  // hollow: the disc goes on behind what rises there
    const int back = edge_towards(edges, next, triangle);
    if (back == 3) return walk;
    const TriangleGeometry g = triangle_geometry(scene, instance, next);
    const float turned = dot(g.front, own.front);
    if (turned < kSameSide && -turned < kSameSide) {
      end_at(walk, own, start, a, b);
      return walk;
    }
    const Vec3 corner[3] = {g.p0, g.p0 + g.e1, g.p0 + g.e2};
    const Vec3 far = corner[(back + 2) % 3];
    const float far_side = dot(far - from, across);
    const bool first = far_side * dot(corner[(back + 1) % 3] - from, across) < 0;
    triangle = next;
    edge = first ? (back + 1) % 3 : (back + 2) % 3;
    const Vec3 other = first ? corner[(back + 1) % 3] : corner[back];
    const float other_side = dot(other - from, across), width = far_side - other_side;
    const Vec3 at = far + (other - far) * (width != 0 ? clamp_to(far_side / width, 0.0f, 1.0f) : 0.0f);
    float reach = -dot(at - from, start.inward), height = dot(at - from, own.front);
    // What is as wide as the disc and lies in another plane has points enough of its own.
    if (reach - walk.reach > radius && turned < kFlatCosine && -turned < kFlatCosine) {
      end_at(walk, own, start, a, b);
      return walk;
    }
    const float last = walk.height;
    if (reach > radius) {
      const float share = (radius - walk.reach) / (reach - walk.reach);
      height = last + share * (height - last);
      reach = radius;
    }
    const float depth = height < 0 ? -height : height;
    const float slope = height < 0 ? steepest : kRiseOfFall * steepest, most = slope * (reach + start.height);
    if (depth > most || !(reach >= walk.reach)) {
      if (reach > walk.reach) {
        // Within this triangle the surface falls evenly.
        const float before = slope * (walk.reach + start.height) - (last < 0 ? -last : last), after = depth - most;
        const float share = before + after > 0 ? clamp_to(before / (before + after), 0.0f, 1.0f) : 0.0f;
        walk.go_to(walk.reach + share * (reach - walk.reach), last + share * (height - last));
      }
      end_at(walk, own, start, a, a);
      return walk;
    }
    walk.go_to(reach, height);
    a = first ? other : far;
    b = first ? far : other;
  }
  return walk;
}

LC_KERNEL bool is_longest(const TriangleGeometry& g, int edge) {
  const float sides[3] = {length_sq(g.e1), length_sq(g.e2 - g.e1), length_sq(g.e2)};
  const float slack = 1.01f * sides[edge];
  return sides[0] <= slack && sides[1] <= slack && sides[2] <= slack;
}

/// Whether beyond the longest edge of `triangle` lies `neighbour`.
LC_KERNEL bool is_half_of_quad(const MeshEdgesView& edges, const TriangleGeometry& g, std::uint32_t triangle,
                               std::uint32_t neighbour) {
  const int edge = edge_towards(edges, triangle, neighbour);
  return edge < 3 && is_longest(g, edge);
}

/// Bounds the disc by what its surface does: it is cut where that ends or turns away, and sunk into the body so far that
/// what remains of it lies below the surface. A surface that is curved all around has a smaller disc too.
LC_KERNEL DiscFace disc_face(const SceneView& scene, const MeshEdgesView& edges, std::uint32_t instance,
                             std::uint32_t triangle, float radius) {
  const TriangleGeometry own = triangle_geometry(scene, instance, triangle);
  DiscFace face;
  face.shape.radius = radius;
  face.area = own.area;
  face.open = (edges.hard[triangle] & kOpenEdge) != 0;
  if (!(own.area > 0)) return face;
  float farthest = 0, fall = 0, rise = 0;
  const auto look_beyond = [&](const TriangleGeometry& g, std::uint32_t of, int edge) {
    const SurfaceReach walk = walk_from(scene, edges, instance, of, g, edge, radius);
    farthest = max_of(farthest, walk.ends ? walk.reach + edge_frame(g, edge).height : radius);
    fall = max_of(fall, walk.fall);
    rise = max_of(rise, walk.rise);
    const bool cuts = walk.ends && (edges.hard[of] >> edge & 1u) == 0;
    if (cuts && !(least_inside(own, walk.inward) < walk.offset - 1e-3f * radius)) {
      add_edge(face, walk.inward, walk.offset);
    }
  };
  add_hard_edges(own, edges.hard[triangle], own, face);
  for (int e = 0; e < 3; ++e) {
    const std::uint32_t next = edges.next[3 * std::size_t{triangle} + static_cast<std::size_t>(e)];
    const TriangleGeometry g = next == kNone ? own : triangle_geometry(scene, instance, next);
    const float turned = dot(g.front, own.front);
    const bool flat = next != kNone && (turned > kFlatCosine || -turned > kFlatCosine);
    if (flat) {
      face.area += g.area;
      add_hard_edges(g, edges.hard[next], own, face);
    }
    const float along = length(edge_frame(own, e).along);
    const bool wide = 2 * g.area >= radius * along;
    if (!flat || !(wide || (is_longest(own, e) && is_half_of_quad(edges, g, next, triangle)))) {
      look_beyond(own, triangle, e);
      continue;
    }
    // The face is a quadrangle or more: what it ends at is beyond the neighbour's edges.
    if (wide) farthest = radius;
    for (int other = 0; other < 3; ++other) {
      if (edges.next[3 * std::size_t{next} + static_cast<std::size_t>(other)] != triangle) look_beyond(g, next, other);
    }
  }
  face.shape.radius = min_of(radius, farthest);
  // Into a body, from wherever the light comes; of a sheet, away from the light.
  face.sink = pack_sink(-fall, (edges.hard[triangle] & kSolid) != 0 ? -fall : rise);
  return face;
}

LC_KERNEL bool is_near_edge(const DiscFace& face, Vec3 at) {
  for (int e = 0; e < face.edge_count; ++e) {
    if (dot(face.shape.inward[e], at) - face.shape.offset[e] < face.shape.radius) return true;
  }
  return false;
}

/// What becomes of a point's disc: entries 0 and 1 of the table of shapes are the first two.
enum class DiscKind : std::uint8_t { whole = 0, small = 1, cut = 2 };

/// Finds the shape of a point's disc: whole where no hard edge of its triangle is near and its surface does not bend.
///
/// @param radius       of whole and cut discs [m]
/// @param small_area   a leaf smaller than this [m^2], cut on several sides, has small discs
/// @param face         receives the shape of a cut disc, and how deep any disc lies
LC_KERNEL DiscKind disc_kind(const SceneView& scene, const MeshEdgesView& edges, const DrawnPoint& point, float radius,
                             float small_area, DiscFace& face) {
  face = disc_face(scene, edges, point.instance, point.triangle, radius);
  // A disc cut on several sides by a sheet smaller than itself would lose what the point stands for (the leaves of a
  // tree): such a point draws the area that it stands for, and no more.
  if (face.open && face.edge_count > 1 && face.area < small_area) {
    face.sink = 0;
    return DiscKind::small;
  }
  return face.shape.radius < radius || is_near_edge(face, point.position) ? DiscKind::cut : DiscKind::whole;
}

}  // namespace lightcuts
