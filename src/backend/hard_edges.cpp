#include "backend/hard_edges.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <numeric>

namespace lightcuts {
namespace {

/// A surface that bends by less goes on: 30 degrees.
constexpr float kSmoothCosine = 0.866f;
/// Sine from which on a neighbour rises over the triangle's plane.
constexpr float kHollowSine = 0.01f;

bool comes_before(Vec3 a, Vec3 b) {
  if (a.x != b.x) return a.x < b.x;
  if (a.y != b.y) return a.y < b.y;
  return a.z < b.z;
}

/// Which place each corner is at: equal numbers for equal positions.
std::vector<std::uint32_t> places_of(const MeshView& mesh) {
  std::uint32_t count = 0;
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    for (const std::uint32_t corner : mesh.triangles[t]) count = std::max(count, corner + 1);
  }
  std::vector<std::uint32_t> order(count), place(count);
  std::iota(order.begin(), order.end(), 0u);
  tbb::parallel_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return comes_before(mesh.positions[a], mesh.positions[b]);
  });
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && comes_before(mesh.positions[order[i - 1]], mesh.positions[order[i]])) ++number;
    place[order[i]] = number;
  }
  return place;
}

struct EdgeUse {
  std::uint64_t key;  ///< both places, the smaller first
  std::uint32_t triangle;
  std::uint8_t edge;
  bool forward;  ///< from the smaller place to the larger
};

std::vector<EdgeUse> sorted_edges(const MeshView& mesh) {
  const std::vector<std::uint32_t> place = places_of(mesh);
  std::vector<EdgeUse> uses;
  uses.reserve(3 * std::size_t{mesh.triangle_count});
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    for (std::uint8_t e = 0; e < 3; ++e) {
      const std::uint64_t a = place[mesh.triangles[t][e]], b = place[mesh.triangles[t][(e + 1) % 3]];
      uses.push_back({std::min(a, b) << 32 | std::max(a, b), t, e, a < b});
    }
  }
  tbb::parallel_sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return a.key != b.key ? a.key < b.key : a.triangle != b.triangle ? a.triangle < b.triangle : a.edge < b.edge;
  });
  return uses;
}

/// Unit vector in the triangle's plane from edge `e` towards the third corner; zero for a needle.
Vec3 away_from_edge(const MeshView& mesh, const EdgeUse& use) {
  const std::uint32_t* corner = mesh.triangles[use.triangle];
  const Vec3 a = mesh.positions[corner[use.edge]], b = mesh.positions[corner[(use.edge + 1) % 3]];
  const Vec3 c = mesh.positions[corner[(use.edge + 2) % 3]];
  const Vec3 along = b - a, to = c - a;
  const float along_sq = length_sq(along);
  if (!(along_sq > 0)) return {};
  const Vec3 away = to - along * (dot(to, along) / along_sq);
  const float len = length(away);
  return len > 0 ? away / len : Vec3{};
}

Vec3 front_of(const MeshView& mesh, std::uint32_t triangle) {
  const std::uint32_t* corner = mesh.triangles[triangle];
  const Vec3 p0 = mesh.positions[corner[0]];
  const Vec3 n = cross(mesh.positions[corner[1]] - p0, mesh.positions[corner[2]] - p0);
  const float len = length(n);
  return len > 0 ? n / len : Vec3{};
}

/// What a neighbour does to an edge.
struct Bend {
  std::uint32_t softens;  ///< bit 0: not hard as seen from the front, bit 1: from the back
  float straight;         ///< cosine of the bend
};
Bend bend_of(const MeshView& mesh, const EdgeUse& use, const EdgeUse& neighbour) {
  const Vec3 inward = away_from_edge(mesh, use), beyond = away_from_edge(mesh, neighbour);
  const float straight = -dot(inward, beyond);
  if (straight >= kSmoothCosine) return {3, straight};
  // Faces that do not agree which side is the front tell nothing of which side the edge stands out of.
  if (use.forward == neighbour.forward) return {0, straight};
  const float rise = dot(front_of(mesh, use.triangle), beyond);
  return {(rise > kHollowSine ? 1u : 0u) | (rise < -kHollowSine ? 2u : 0u), straight};
}

/// Finds what triangles are connected, and which such parts are closed bodies that they face out of.
class Bodies {
 public:
  explicit Bodies(const MeshView& mesh) : mesh_(mesh), parent_(mesh.triangle_count), open_(mesh.triangle_count, 0) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  /// All uses of one edge.
  void add(const EdgeUse* begin, const EdgeUse* end) {
    int forward = 0;
    for (const EdgeUse* use = begin; use != end; ++use) {
      join(use->triangle, begin->triangle);
      forward += use->forward ? 1 : -1;
    }
    // Of a closed body each edge is run through as often one way as the other.
    if (forward != 0) open_[root(begin->triangle)] = 1;
  }

  void mark(std::vector<std::uint8_t>& hard) {
    std::vector<double> volume(parent_.size(), 0.0);
    std::vector<std::uint8_t> open(parent_.size(), 0);
    for (std::uint32_t t = 0; t < mesh_.triangle_count; ++t) {
      const std::uint32_t* corner = mesh_.triangles[t];
      const Vec3 start = mesh_.positions[mesh_.triangles[root(t)][0]];  // near the part, against cancellation
      const Vec3 a = mesh_.positions[corner[0]] - start, b = mesh_.positions[corner[1]] - start;
      volume[root(t)] += static_cast<double>(dot(a, cross(b, mesh_.positions[corner[2]] - start)));
      open[root(t)] |= open_[t];
    }
    for (std::uint32_t t = 0; t < mesh_.triangle_count; ++t) {
      if (open[root(t)] == 0 && volume[root(t)] > 0) hard[t] |= kSolid;
    }
  }

 private:
  std::uint32_t root(std::uint32_t t) {
    while (parent_[t] != t) t = parent_[t] = parent_[parent_[t]];
    return t;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

  const MeshView& mesh_;
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> open_;
};

}  // namespace

MeshEdges hard_edges(const MeshView& mesh) {
  MeshEdges edges{std::vector<std::uint8_t>(mesh.triangle_count, 0),
                  std::vector<std::array<std::uint32_t, 3>>(mesh.triangle_count, {kNone, kNone, kNone})};
  const std::vector<EdgeUse> uses = sorted_edges(mesh);
  // An edge that hundreds of triangles share belongs to no surface: looking at a few neighbours is enough.
  constexpr std::size_t most_neighbours = 8;
  Bodies bodies(mesh);
  for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    for (end = begin; end < uses.size() && uses[end].key == uses[begin].key;) ++end;
    const std::size_t looked_at = std::min(end, begin + most_neighbours);
    const bool is_point = uses[begin].key >> 32 == (uses[begin].key & 0xffffffffu);
    if (!is_point) bodies.add(uses.data() + begin, uses.data() + end);
    for (std::size_t i = begin; i < end; ++i) {
      std::uint32_t soft = 0, others = 0;
      float straightest = kSmoothCosine;
      for (std::size_t j = begin; j < looked_at; ++j) {
        if (uses[j].triangle == uses[i].triangle) continue;
        const Bend bend = bend_of(mesh, uses[i], uses[j]);
        soft |= bend.softens;
        ++others;
        if (bend.straight >= straightest) {
          straightest = bend.straight;
          edges.next[uses[i].triangle][uses[i].edge] = uses[j].triangle;
        }
      }
      std::uint8_t& bits = edges.hard[uses[i].triangle];
      if (others == 0) bits |= kOpenEdge;
      if ((soft & 1u) == 0) bits = static_cast<std::uint8_t>(bits | 1u << uses[i].edge);
      if ((soft & 2u) == 0) bits = static_cast<std::uint8_t>(bits | 8u << uses[i].edge);
    }
  }
  bodies.mark(edges.hard);
  return edges;
}

}  // namespace lightcuts
