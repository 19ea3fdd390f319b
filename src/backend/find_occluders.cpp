#include "backend/find_occluders.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <utility>

#include "kernels/surface.h"

namespace lightcuts {
namespace {

/// Only so many triangles, the largest, are looked at: small ones hide little.
constexpr std::size_t kMostTriangles = 16384;
/// An occluder is at least this share of the scene's diagonal wide, squared.
constexpr float kSmallestArea = 1e-6f;
/// An edge that more polygons share joins none of them: trying all pairs of what hostile files pile up would take minutes.
constexpr std::size_t kMostSharing = 8;

struct Polygon {
  std::vector<Vec3> corners;
  Vec3 normal;
  float area = 0;
  std::uint32_t mesh = 0;
};

struct Candidate {
  float area;
  std::uint32_t instance, triangle;
};

std::vector<Candidate> largest_triangles(const SceneView& scene) {
  std::vector<Candidate> found;
  const float smallest = kSmallestArea * scene.diagonal * scene.diagonal;
  const auto larger = [](const Candidate& a, const Candidate& b) {
    return a.area != b.area           ? a.area > b.area
           : a.instance != b.instance ? a.instance < b.instance
                                      : a.triangle < b.triangle;
  };
  for (std::uint32_t i = 0; i < scene.instance_count; ++i) {
    const MeshView& mesh = scene.meshes[scene.instances[i].mesh];
    if (scene.materials[mesh.material].masked) continue;
    for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
      const float area = triangle_geometry(scene, i, t).area;
      if (!(area > smallest)) continue;
      found.push_back({area, i, t});
      if (found.size() < 2 * kMostTriangles) continue;
      std::nth_element(found.begin(), found.begin() + kMostTriangles, found.end(), larger);
      found.resize(kMostTriangles);
    }
  }
  std::sort(found.begin(), found.end(), larger);
  if (found.size() > kMostTriangles) found.resize(kMostTriangles);
  return found;
}

Polygon polygon_of(const SceneView& scene, const Candidate& candidate) {
  const InstanceView& placed = scene.instances[candidate.instance];
  const MeshView& mesh = scene.meshes[placed.mesh];
  Polygon polygon;
  for (const std::uint32_t corner : mesh.triangles[candidate.triangle]) {
    polygon.corners.push_back(transform_point(placed.world_from_object, mesh.positions[corner]));
  }
  const TriangleGeometry g = triangle_geometry(scene, candidate.instance, candidate.triangle);
  polygon.normal = normalize(cross(g.e1 * (1 / std::sqrt(g.area)), g.e2 * (1 / std::sqrt(g.area))));
  polygon.area = candidate.area;
  return polygon;
}

/// Unit vector in the plane, to the left of the edge from a to b.
Vec3 inward_of(Vec3 normal, Vec3 a, Vec3 b) {
  const Vec3 across = cross(normal, b - a);
  const float size = length(across);
  return size > 0 ? across / size : Vec3{};
}

/// Leaves out corners on straight lines; false if some corner turns the wrong way by more than rounding.
bool make_convex(Polygon& polygon, float rounding) {
  std::vector<Vec3>& corners = polygon.corners;
  for (std::size_t i = 0; i < corners.size() && corners.size() > 2;) {
    const Vec3 before = corners[(i + corners.size() - 1) % corners.size()], after = corners[(i + 1) % corners.size()];
    const float outside = dot(inward_of(polygon.normal, before, after), corners[i] - before);  // negative: turns left
    if (outside > rounding) return false;
    if (outside >= -rounding) {
      corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
  return corners.size() >= 3 && corners.size() <= kOccluderCorners;
}

class Merging {
 public:
  Merging(std::vector<Polygon> polygons, float rounding) : polygons_(std::move(polygons)), rounding_(rounding) {}

  std::vector<Polygon> run() {
    for (std::uint32_t i = 0; i < polygons_.size(); ++i) enter(i);
    for (std::uint32_t i = 0; i < polygons_.size(); ++i) {
      while (grow(i)) {
      }
    }
    std::erase_if(polygons_, [](const Polygon& p) { return p.corners.empty(); });
    return std::move(polygons_);
  }

 private:
  using Place = std::array<std::uint32_t, 3>;
  using Edge = std::pair<Place, Place>;

  static Place place_of(Vec3 p) {
    const auto bits_of = [](float v) { return std::bit_cast<std::uint32_t>(v + 0.0f); };  // -0 is 0
    return {bits_of(p.x), bits_of(p.y), bits_of(p.z)};
  }
  Edge edge_of(const Polygon& polygon, std::size_t i) const {
    const Place a = place_of(polygon.corners[i]), b = place_of(polygon.corners[(i + 1) % polygon.corners.size()]);
    return {std::min(a, b), std::max(a, b)};
  }

  void enter(std::uint32_t i) {
    for (std::size_t e = 0; e < polygons_[i].corners.size(); ++e) edges_[edge_of(polygons_[i], e)].push_back(i);
  }
  void leave(std::uint32_t i) {
    for (std::size_t e = 0; e < polygons_[i].corners.size(); ++e) {
      std::erase(edges_[edge_of(polygons_[i], e)], i);
    }
  }

  /// Merges polygon i with a neighbour; false if none fits.
  bool grow(std::uint32_t i) {
    for (std::size_t e = 0; e < polygons_[i].corners.size(); ++e) {
      const std::vector<std::uint32_t>& sharing = edges_[edge_of(polygons_[i], e)];
      if (sharing.size() > kMostSharing) continue;
      for (const std::uint32_t other : sharing) {
        Polygon merged;
        if (other == i || !merge(polygons_[i], e, polygons_[other], merged)) continue;
        leave(i);
        leave(other);
        polygons_[i] = std::move(merged);
        polygons_[other].corners.clear();
        enter(i);
        return true;
      }
    }
    return false;
  }

  bool merge(const Polygon& p, std::size_t edge, Polygon q, Polygon& merged) const {
    if (dot(p.normal, q.normal) < 0) {
      std::reverse(q.corners.begin(), q.corners.end());
      q.normal = -q.normal;
    }
    for (const Vec3 corner : q.corners) {
      if (std::abs(dot(p.normal, corner - p.corners[edge])) > rounding_) return false;
    }
    // Around p from the end of the edge on, then around q from the edge's start on, where that comes second.
    const std::size_t np = p.corners.size(), nq = q.corners.size();
    const Vec3 a = p.corners[edge], b = p.corners[(edge + 1) % np];
    std::size_t start = nq;
    for (std::size_t k = 0; k < nq; ++k) {
      if (q.corners[k] == b && q.corners[(k + 1) % nq] == a) start = k;
    }
    if (start == nq) return false;  // both on the same side of the edge
    merged.normal = p.normal;
    merged.area = p.area + q.area;
    for (std::size_t k = 0; k < np; ++k) merged.corners.push_back(p.corners[(edge + 1 + k) % np]);
    for (std::size_t k = 2; k < nq; ++k) merged.corners.push_back(q.corners[(start + k) % nq]);
    return make_convex(merged, rounding_);
  }

  std::vector<Polygon> polygons_;
  float rounding_;
  std::map<Edge, std::vector<std::uint32_t>> edges_;
};

Occluder occluder_of(const Polygon& polygon) {
  Occluder occluder{};
  const std::size_t count = polygon.corners.size();
  occluder.normal = polygon.normal;
  occluder.area = polygon.area;
  for (std::size_t i = 0; i < kOccluderCorners; ++i) occluder.corner[i] = polygon.corners[std::min(i, count - 1)];
  for (std::size_t i = 0; i < kOccluderCorners; ++i) {
    // The edge from a triangle's last corner to itself stands for the one back to the first.
    const Vec3 a = occluder.corner[i], b = polygon.corners[(std::min(i, count - 1) + 1) % count];
    occluder.inward[i] = inward_of(polygon.normal, a, b);
  }
  return occluder;
}

}  // namespace

std::vector<Occluder> find_occluders(const SceneView& scene, std::size_t most) {
  std::vector<Polygon> polygons;
  for (const Candidate& candidate : largest_triangles(scene)) polygons.push_back(polygon_of(scene, candidate));
  const float largest = max_of(max_component(absolute(scene.bounds.lo)), max_component(absolute(scene.bounds.hi)));
  polygons = Merging(std::move(polygons), occluder_rounding(largest)).run();
  std::stable_sort(polygons.begin(), polygons.end(),
                   [](const Polygon& a, const Polygon& b) { return a.area > b.area; });
  if (polygons.size() > most) polygons.resize(most);
  std::vector<Occluder> occluders;
  occluders.reserve(polygons.size());
  for (const Polygon& polygon : polygons) occluders.push_back(occluder_of(polygon));
  return occluders;
}

}  // namespace lightcuts
