#include "cpu/ism/surface_points.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "cpu/ism/hard_edges.h"
#include "kernels/light_key.h"
#include "kernels/surface.h"
#include "math/sample_stream.h"

namespace lightcuts {
namespace {

constexpr std::size_t kPadding = 16;  // entries that SIMD code may read past the end

struct PlacedTriangle {
  std::uint32_t instance, triangle;
};

/// The scene's triangles along a space-filling curve, so that neighbours in the order are neighbours in the scene: then
/// a block of the points' order spreads evenly over finely tessellated surfaces too.
class TriangleOrder {
 public:
  explicit TriangleOrder(const SceneView& scene) {
    std::uint64_t count = 0;
    for (std::uint32_t i = 0; i < scene.instance_count; ++i) {
      first_of_instance_.push_back(count);
      count += scene.meshes[scene.instances[i].mesh].triangle_count;
    }
    count_ = count;
    // Sorting hundreds of millions of instanced triangles would take too much memory: they stay in the scene's order.
    constexpr std::uint64_t most_sorted = 1u << 24;
    if (count <= most_sorted) sort(scene);
  }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] PlacedTriangle at(std::uint64_t i) const {
    if (!sorted_.empty()) return sorted_[i];
    const auto after = std::upper_bound(first_of_instance_.begin(), first_of_instance_.end(), i);
    const auto instance = static_cast<std::size_t>(after - first_of_instance_.begin() - 1);
    return {static_cast<std::uint32_t>(instance), static_cast<std::uint32_t>(i - first_of_instance_[instance])};
  }

 private:
  void sort(const SceneView& scene) {
    struct Keyed {
      std::uint64_t key;
      PlacedTriangle triangle;
    };
    std::vector<Keyed> keyed(count_);
    tbb::parallel_for(tbb::blocked_range<std::uint64_t>(0, count_, 1024),
                      [&](const tbb::blocked_range<std::uint64_t>& range) {
                        for (std::uint64_t i = range.begin(); i != range.end(); ++i) {
                          const PlacedTriangle t = at(i);
                          const TriangleGeometry g = triangle_geometry(scene, t.instance, t.triangle);
                          const Vec3 middle = g.p0 + (g.e1 + g.e2) * (1.0f / 3.0f);
                          // Sides that face apart first: both faces of a thin board get points of their own.
                          keyed[i] = {light_key(middle, g.front, scene.bounds, {16, 1, 0}), t};
                        }
                      });
    tbb::parallel_sort(keyed.begin(), keyed.end(), [](const Keyed& a, const Keyed& b) {
      if (a.key != b.key) return a.key < b.key;
      const PlacedTriangle s = a.triangle, t = b.triangle;
      return s.instance != t.instance ? s.instance < t.instance : s.triangle < t.triangle;
    });
    std::vector<PlacedTriangle> sorted;
    sorted.reserve(count_);
    for (const Keyed& k : keyed) sorted.push_back(k.triangle);
    sorted_ = std::move(sorted);
  }

  std::uint64_t count_ = 0;
  std::vector<std::uint64_t> first_of_instance_;
  std::vector<PlacedTriangle> sorted_;
};

constexpr std::uint64_t kChunk = 16;

/// The area before every 16th triangle of the order: what a search by area starts with. Sums of each triangle would take
/// much more memory.
std::vector<double> area_before_chunks(const SceneView& scene, const TriangleOrder& order, double& area) {
  std::vector<double> before;
  area = 0;
  for (std::uint64_t i = 0; i < order.count(); ++i) {
    if (i % kChunk == 0) before.push_back(area);
    const PlacedTriangle t = order.at(i);
    area += triangle_geometry(scene, t.instance, t.triangle).area;
  }
  return before;
}

/// Place in a triangle for a number in [0, 1): a quarter of it names a quarter of the triangle, and so on.
/// The result weighs corners 1 and 2. Source: Basu and Owen 2015, section 3.
Vec2 subdivide(double number) {
  Vec2 a{0, 0}, b{1, 0}, c{0, 1};
  for (int depth = 0; depth < 12; ++depth) {
    number *= 4;
    const int quarter = std::min(3, static_cast<int>(number));
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

/// Point `index` of the sequence.
DrawnPoint draw_point(const SceneView& scene, const TriangleOrder& order, const std::vector<double>& area_before,
                      double area, std::uint32_t index, std::uint32_t key) {
  // 32 bits are few for a tiny triangle's inside: random ones follow.
  const std::uint64_t high = owen_scramble(reverse_bits(index), key), low = combine_bits(index, key);
  const double at = static_cast<double>((high << 32 | low) >> 11) * 0x1p-53 * area;
  const auto after = std::upper_bound(area_before.begin(), area_before.end(), at);
  const auto chunk = static_cast<std::uint64_t>(after - area_before.begin() - 1);
  double rest = at - area_before[chunk];
  TriangleGeometry g{};
  PlacedTriangle found = order.at(chunk * kChunk);
  for (std::uint64_t i = chunk * kChunk; i < std::min(order.count(), (chunk + 1) * kChunk); ++i) {
    const PlacedTriangle t = order.at(i);
    const TriangleGeometry candidate = triangle_geometry(scene, t.instance, t.triangle);
    if (!(candidate.area > 0)) continue;
    g = candidate;
    found = t;
    if (rest < g.area) break;
    rest -= g.area;
  }
  const double share = g.area > 0 ? std::clamp(rest / g.area, 0.0, 1.0) : 0.0;
  const Vec2 weight = subdivide(share);
  DrawnPoint point{g.p0 + g.e1 * weight.x + g.e2 * weight.y, g.front, found.instance, found.triangle};
  const MeshView& mesh = scene.meshes[scene.instances[found.instance].mesh];
  if (cut_away(scene, mesh, found.triangle, weight.x, weight.y)) point.instance = kNone;
  return point;
}

/// Draws until there are enough points, leaving out what is cut away; where almost everything is, stops early.
std::vector<DrawnPoint> draw_points(const SceneView& scene, std::size_t wanted, std::uint64_t seed, double& area) {
  const TriangleOrder order(scene);
  const std::vector<double> area_before = area_before_chunks(scene, order, area);
  std::vector<DrawnPoint> points;
  if (area_before.empty() || !(area > 0)) return points;
  points.reserve(wanted);
  const auto key = static_cast<std::uint32_t>(derive_seed(seed, 0x69736d));
  const std::size_t most = 16 * wanted;
  std::vector<DrawnPoint> round(std::min<std::size_t>(wanted, 1u << 16));
  std::size_t tried = 0;
  for (; points.size() < wanted && tried < most; tried += round.size()) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, round.size(), 1024), [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t i = range.begin(); i != range.end(); ++i) {
            round[i] = draw_point(scene, order, area_before, area, static_cast<std::uint32_t>(tried + i), key);
          }
        });
    for (const DrawnPoint& point : round) {
      if (point.instance != kNone && points.size() < wanted) points.push_back(point);
    }
  }
  if (points.size() < wanted) area *= static_cast<double>(points.size()) / static_cast<double>(tried);
  return points;
}

/// Finds the shape of each point's disc: whole where no hard edge of its triangle is near.
class Shapes {
 public:
  Shapes(const SceneView& scene, float radius, float overlap, std::vector<DiscShape>& shapes)
      : scene_(scene), small_area_(kPi * radius * radius), shapes_(shapes), edges_(scene.mesh_count) {
    shapes_ = {DiscShape{}, DiscShape{}};
    shapes_[0].radius = radius * overlap;
    shapes_[1].radius = radius;
  }

  std::uint32_t of(const DrawnPoint& point) {
    const std::uint32_t mesh = scene_.instances[point.instance].mesh;
    if (edges_[mesh].hard.empty()) edges_[mesh] = hard_edges(scene_.meshes[mesh]);
    if (!has_hard_edge(edges_[mesh], point.triangle)) return 0;
    const Face face = face_of(point);
    if (face.edge_count == 0) return 0;
    // A disc cut on several sides by a face smaller than itself would lose what the point stands for (the leaves of a
    // tree): such a point draws the area that it stands for, and no more.
    if (face.edge_count > 1 && face.area < small_area_) return 1;
    if (!is_near_edge(face, point.position)) return 0;
    const auto [found, is_new] =
        of_triangle_.try_emplace(std::uint64_t{point.instance} << 32 | point.triangle, shapes_.size());
    if (is_new) shapes_.push_back(face.shape);
    return static_cast<std::uint32_t>(found->second);
  }

 private:
  /// A triangle and those that go on from it in its plane, as far as discs are cut by their edges.
  struct Face {
    DiscShape shape;
    int edge_count = 0;
    float area = 0;
  };

  static bool has_hard_edge(const MeshEdges& edges, std::uint32_t triangle) {
    if (edges.hard[triangle] != 0) return true;
    for (const std::uint32_t next : edges.flat[triangle]) {
      if (next != kNone && edges.hard[next] != 0) return true;
    }
    return false;
  }

  [[nodiscard]] Face face_of(const DrawnPoint& point) const {
    const InstanceView& placed = scene_.instances[point.instance];
    const MeshEdges& edges = edges_[placed.mesh];
    const TriangleGeometry own = triangle_geometry(scene_, point.instance, point.triangle);
    const std::uint32_t side = determinant(placed.world_from_object) < 0 ? 3 : 0;
    Face face;
    face.shape = shapes_[0];
    face.area = own.area;
    add_edges(own, edges.hard[point.triangle] >> side, own, face);
    for (const std::uint32_t next : edges.flat[point.triangle]) {
      if (next == kNone) continue;
      const TriangleGeometry g = triangle_geometry(scene_, point.instance, next);
      face.area += g.area;
      add_edges(g, edges.hard[next] >> side, own, face);
    }
    return face;
  }

  /// Adds the hard edges of a triangle of the face. Where the face is not convex, the line of a neighbour's edge may run
  /// through the point's own triangle: that one cuts nothing.
  static void add_edges(const TriangleGeometry& g, std::uint32_t hard, const TriangleGeometry& own, Face& face) {
    const Vec3 corner[3] = {g.p0, g.p0 + g.e1, g.p0 + g.e2};
    for (int e = 0; e < 3 && face.edge_count < kDiscEdges; ++e) {
      if ((hard >> e & 1u) == 0) continue;
      const Vec3 a = corner[e], along = corner[(e + 1) % 3] - a, to = corner[(e + 2) % 3] - a;
      const Vec3 away = to - along * (dot(to, along) / length_sq(along));
      const float len = length(away);
      if (!(len > 0)) continue;
      const Vec3 inward = away / len;
      const float slack = 1e-3f * len;
      const float own_least =
          min_of(dot(own.p0 - a, inward), min_of(dot(own.p0 + own.e1 - a, inward), dot(own.p0 + own.e2 - a, inward)));
      if (own_least < -slack) continue;
      face.shape.inward[face.edge_count] = inward;
      face.shape.offset[face.edge_count++] = dot(inward, a);
    }
  }

  static bool is_near_edge(const Face& face, Vec3 at) {
    for (int e = 0; e < face.edge_count; ++e) {
      if (dot(face.shape.inward[e], at) - face.shape.offset[e] < face.shape.radius) return true;
    }
    return false;
  }

  const SceneView& scene_;
  float small_area_;
  std::vector<DiscShape>& shapes_;
  std::vector<MeshEdges> edges_;
  std::unordered_map<std::uint64_t, std::size_t> of_triangle_;
};

}  // namespace

std::size_t SurfacePoints::count_for(const PointOptions& options) {
  // Enough that maps differ, not more than a map needs many times over.
  const std::size_t per_map = options.per_map;
  return std::max(per_map, std::clamp<std::size_t>(16 * per_map, 1u << 16, 1u << 21));
}

std::uint64_t SurfacePoints::bytes_for(const PointOptions& options) {
  // Drawn once, then laid out; at worst every point has a shape of its own.
  return count_for(options) * (sizeof(DrawnPoint) + 7 * sizeof(float) + sizeof(DiscShape) + 32);
}

SurfacePoints::SurfacePoints(const SceneView& scene, const PointOptions& options)
    : options_(options), bounds_(scene.bounds) {
  const std::vector<DrawnPoint> points = draw_points(scene, count_for(options), options.seed, area_);
  count_ = points.size();
  const double area_of_one = area_ / static_cast<double>(options.per_map);
  Shapes shapes(scene, static_cast<float>(std::sqrt(area_of_one / 3.14159265358979)), options.overlap, shapes_);

  const std::size_t stride = count_ + kPadding;
  values_.assign(6 * stride, 0.0f);
  shape_.assign(stride, 0u);
  float* columns[6];
  for (std::size_t c = 0; c < 6; ++c) columns[c] = values_.data() + c * stride;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3 p = points[i].position, n = points[i].normal;
    const float row[6] = {p.x, p.y, p.z, n.x, n.y, n.z};
    for (std::size_t c = 0; c < 6; ++c) columns[c][i] = row[c];
    shape_[i] = shapes.of(points[i]);
  }
  arrays_ = {columns[0], columns[1], columns[2], columns[3], columns[4], columns[5], shape_.data(), shapes_.data()};
}

}  // namespace lightcuts
