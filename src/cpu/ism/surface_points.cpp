#include "cpu/ism/surface_points.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "backend/hard_edges.h"
#include "kernels/surface_points.h"

namespace lightcuts {
namespace {

constexpr std::size_t kPadding = 16;  // entries that SIMD code may read past the end

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
    if (count <= kMostSortedTriangles) sort(scene);
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
                          keyed[i] = {triangle_key(scene, t), t};
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

std::vector<double> area_before_chunks(const SceneView& scene, const TriangleOrder& order, double& area) {
  constexpr std::uint64_t most = 1u << 20;  // triangles whose areas are found at a time
  std::vector<double> before;
  std::vector<float> areas(std::min(most, order.count()));
  area = 0;
  for (std::uint64_t first = 0; first < order.count(); first += most) {
    const std::uint64_t count = std::min(most, order.count() - first);
    tbb::parallel_for(tbb::blocked_range<std::uint64_t>(0, count, 1024),
                      [&](const tbb::blocked_range<std::uint64_t>& range) {
                        for (std::uint64_t i = range.begin(); i != range.end(); ++i) {
                          const PlacedTriangle t = order.at(first + i);
                          areas[i] = triangle_geometry(scene, t.instance, t.triangle).area;
                        }
                      });
    for (std::uint64_t i = 0; i < count; ++i) {
      if ((first + i) % kAreaChunk == 0) before.push_back(area);
      area += double{areas[i]};
    }
  }
  return before;
}

/// What draw_point asks for the triangles.
struct OrderRef {
  const TriangleOrder* order;
  PlacedTriangle operator()(std::uint64_t i) const { return order->at(i); }
};

/// Draws until there are enough points, leaving out what is cut away; where almost everything is, stops early.
std::vector<DrawnPoint> draw_points(const SceneView& scene, std::size_t wanted, std::uint64_t seed, double& area) {
  const TriangleOrder order(scene);
  const std::vector<double> area_before = area_before_chunks(scene, order, area);
  std::vector<DrawnPoint> points;
  if (area_before.empty() || !(area > 0)) return points;
  points.reserve(wanted);
  const AreaTable<OrderRef> table{{&order}, order.count(), area_before.data(), area_before.size(), area};
  const std::uint32_t stream = point_stream(seed);
  const std::size_t most = most_point_draws(wanted);
  std::vector<DrawnPoint> round(point_round(wanted));
  std::size_t tried = 0;
  for (; points.size() < wanted && tried < most; tried += round.size()) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, round.size(), 1024),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i != range.end(); ++i) {
                          round[i] = draw_point(scene, table, static_cast<std::uint32_t>(tried + i), stream);
                        }
                      });
    for (const DrawnPoint& point : round) {
      if (point.instance != kNone && points.size() < wanted) points.push_back(point);
    }
  }
  if (points.size() < wanted) area *= static_cast<double>(points.size()) / static_cast<double>(tried);
  return points;
}

struct FoundShape {
  DiscKind kind;
  DiscFace face;
};

/// Finds the discs of points.
std::vector<FoundShape> find_shapes(const SceneView& scene, const std::vector<DrawnPoint>& points, float radius,
                                    float overlap) {
  std::vector<std::uint8_t> has_points(scene.mesh_count, 0);
  for (const DrawnPoint& point : points) has_points[scene.instances[point.instance].mesh] = 1;
  std::vector<MeshEdges> edges(scene.mesh_count);
  tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t mesh) {
    if (has_points[mesh] != 0) edges[mesh] = hard_edges(scene.meshes[mesh]);
  });
  std::vector<FoundShape> found(points.size());
  const float small_area = kPi * radius * radius;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 256),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i != range.end(); ++i) {
                        const MeshEdgesView view = edges[scene.instances[points[i].instance].mesh].view();
                        found[i].kind = disc_kind(scene, view, points[i], radius * overlap, small_area, found[i].face);
                      }
                    });
  return found;
}

/// The table of shapes: a whole disc, a small one, then those of triangles whose discs are cut, each once.
class Shapes {
 public:
  Shapes(float radius, float overlap, std::vector<DiscShape>& shapes) : shapes_(shapes) {
    shapes_ = {DiscShape{}, DiscShape{}};
    shapes_[0].radius = radius * overlap;
    shapes_[1].radius = radius;
  }

  std::uint32_t of(const DrawnPoint& point, const FoundShape& found) {
    if (found.kind != DiscKind::cut) return static_cast<std::uint32_t>(found.kind);
    const auto [at, is_new] =
        of_triangle_.try_emplace(std::uint64_t{point.instance} << 32 | point.triangle, shapes_.size());
    if (is_new) shapes_.push_back(found.face.shape);
    return static_cast<std::uint32_t>(at->second);
  }

 private:
  std::vector<DiscShape>& shapes_;
  std::unordered_map<std::uint64_t, std::size_t> of_triangle_;
};

}  // namespace

std::size_t SurfacePoints::count_for(const PointOptions& options) { return surface_point_count(options.per_map); }

std::uint64_t SurfacePoints::bytes_for(const PointOptions& options) {
  // Drawn once, then laid out; at worst every point has a shape of its own.
  return count_for(options) * (sizeof(DrawnPoint) + sizeof(FoundShape) + 9 * sizeof(float) + sizeof(DiscShape) + 32);
}

SurfacePoints::SurfacePoints(const SceneView& scene, const PointOptions& options)
    : options_(options), bounds_(scene.bounds) {
  const std::vector<DrawnPoint> points = draw_points(scene, count_for(options), options.seed, area_);
  count_ = points.size();
  const float radius = point_radius(area_, options.per_map);
  const std::vector<FoundShape> found = find_shapes(scene, points, radius, options.overlap);
  Shapes shapes(radius, options.overlap, shapes_);

  const std::size_t stride = count_ + kPadding;
  values_.assign(8 * stride, 0.0f);
  shape_.assign(stride, 0u);
  float* columns[8];
  for (std::size_t c = 0; c < 8; ++c) columns[c] = values_.data() + c * stride;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3 p = points[i].position, n = points[i].normal;
    const float sink = found[i].face.sink;
    const float row[8] = {p.x, p.y, p.z, n.x, n.y, n.z, sink_in_front(sink), sink_behind(sink)};
    for (std::size_t c = 0; c < 8; ++c) columns[c][i] = row[c];
    shape_[i] = shapes.of(points[i], found[i]);
  }
  arrays_ = {columns[0], columns[1], columns[2], columns[3],    columns[4],
             columns[5], columns[6], columns[7], shape_.data(), shapes_.data()};
}

}  // namespace lightcuts
