#include "cuda/surface_points.h"

#include <algorithm>

#include "backend/hard_edges.h"
#include "cuda/executor.cuh"

namespace lightcuts::cuda {
namespace {

/// Radius of a disc relative to that of a circle with the area that a point stands for; as the CPU's.
constexpr float kOverlap = 1.7f;

/// The instance of triangle `i` of all: the last one that begins at or before it.
LC_KERNEL PlacedTriangle placed(const std::uint32_t* instance_begin, std::uint32_t instance_count, std::uint32_t i) {
  std::uint32_t lo = 0, hi = instance_count;
  while (lo + 1 < hi) {
    const std::uint32_t middle = (lo + hi) / 2;
    (instance_begin[middle] <= i ? lo : hi) = middle;
  }
  return {lo, i - instance_begin[lo]};
}

/// Triangles along the curve, or in the scene's order where `sorted` is null.
struct DeviceOrder {
  const std::uint32_t* sorted;
  const std::uint32_t* instance_begin;
  std::uint32_t instance_count;
  LC_KERNEL PlacedTriangle operator()(std::uint64_t i) const {
    const auto at = static_cast<std::uint32_t>(i);
    return placed(instance_begin, instance_count, sorted != nullptr ? sorted[at] : at);
  }
};

struct MakeKeys {
  SceneView scene;
  const std::uint32_t* instance_begin;
  std::uint64_t* keys;
  std::uint32_t* values;
  __device__ void operator()(std::uint32_t i) const {
    keys[i] = triangle_key(scene, placed(instance_begin, scene.instance_count, i));
    values[i] = i;
  }
};

struct SumChunks {
  SceneView scene;
  DeviceOrder order;
  std::uint32_t triangle_count;
  double* sums;
  __device__ void operator()(std::uint32_t chunk) const {
    double sum = 0;
    const std::uint64_t first = chunk * kAreaChunk, end = min_of<std::uint64_t>(triangle_count, first + kAreaChunk);
    for (std::uint64_t i = first; i < end; ++i) {
      const PlacedTriangle t = order(i);
      sum += triangle_geometry(scene, t.instance, t.triangle).area;
    }
    sums[chunk] = sum;
  }
};

constexpr int kScanThreads = 1024;

/// Turns sums into what comes before them, in place, by one block: additions in a fixed order, so that every run gives
/// the same bits, which the library's prefix sums of floating point do not promise. `total` receives the sum of all.
__global__ void __launch_bounds__(kScanThreads) scan_areas(double* sums, std::uint32_t count, double* total) {
  __shared__ double parts[kScanThreads];
  const std::uint32_t each = (count + kScanThreads - 1) / kScanThreads;
  const std::uint32_t first = min(count, threadIdx.x * each), end = min(count, first + each);
  double sum = 0;
  for (std::uint32_t i = first; i < end; ++i) sum += sums[i];
  parts[threadIdx.x] = sum;
  __syncthreads();
  if (threadIdx.x == 0) {
    double before = 0;
    for (double& part : parts) {
      const double own = part;
      part = before;
      before += own;
    }
    *total = before;
  }
  __syncthreads();
  double before = parts[threadIdx.x];
  for (std::uint32_t i = first; i < end; ++i) {
    const double own = sums[i];
    sums[i] = before;
    before += own;
  }
}

struct DrawPoints {
  SceneView scene;
  AreaTable<DeviceOrder> table;
  std::uint32_t tried, stream;
  DrawnPoint* round;
  std::uint32_t* kept;
  __device__ void operator()(std::uint32_t i) const {
    round[i] = draw_point(scene, table, tried + i, stream);
    kept[i] = round[i].instance != kNone ? 1 : 0;
  }
};

struct KeepPoints {
  const DrawnPoint* round;
  const std::uint32_t* kept;
  const std::uint32_t* places;
  std::uint32_t first, wanted;
  DrawnPoint* points;
  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t place = first + places[i];
    if (kept[i] != 0 && place < wanted) points[place] = round[i];
  }
};

/// What every point's shape needs.
struct ShapeMaker {
  SceneView scene;
  const MeshEdgesView* edges;
  const std::uint32_t* instance_begin;
  const DrawnPoint* drawn;
  float radius, small, small_area;

  __device__ DiscKind kind(std::uint32_t i, DiscFace& face) const {
    return disc_kind(scene, edges[scene.instances[drawn[i].instance].mesh], drawn[i], radius, small_area, face);
  }
  __device__ std::uint32_t triangle(std::uint32_t i) const {
    return instance_begin[drawn[i].instance] + drawn[i].triangle;
  }
};

/// Lays the points out, and marks the triangles whose discs are cut: they need edges of their own.
struct LayOut {
  ShapeMaker make;
  SurfacePoint* points;
  float* radii;
  std::uint32_t* marks;
  __device__ void operator()(std::uint32_t i) const {
    DiscFace face;
    const DiscKind kind = make.kind(i, face);
    points[i] = {make.drawn[i].position, kind == DiscKind::cut ? 1u : 0u, make.drawn[i].normal, face.sink};
    radii[i] = kind == DiscKind::small ? make.small : kind == DiscKind::cut ? face.shape.radius : make.radius;
    if (kind == DiscKind::cut) marks[make.triangle(i)] = 1;
  }
};

struct WriteEdges {
  ShapeMaker make;
  const std::uint32_t* numbers;
  SurfacePoint* points;
  DiscEdge* edges;
  __device__ void operator()(std::uint32_t i) const {
    if (points[i].cuts == 0) return;
    const DrawnPoint& point = make.drawn[i];
    const std::uint32_t mesh = make.scene.instances[point.instance].mesh;
    const DiscShape shape = disc_face(make.scene, make.edges[mesh], point.instance, point.triangle, make.radius).shape;
    std::uint32_t cuts = numbers[make.triangle(i)] << 4;
    for (int e = 0; e < kDiscEdges; ++e) {
      // Points of one triangle write the same.
      edges[first_edge(cuts) + static_cast<std::uint32_t>(e)] = {shape.inward[e], shape.offset[e]};
      if (shape.inward[e] == Vec3{}) continue;  // none
      if (!(dot(shape.inward[e], point.position) - shape.offset[e] >= shape.radius)) cuts |= 1u << e;
    }
    points[i].cuts = near_edges(cuts) != 0 ? cuts : 0;
  }
};

}  // namespace

DeviceEdges::DeviceEdges(Device& device, const SceneView& host) {
  std::vector<std::uint8_t> hard;
  std::vector<std::uint32_t> next;
  std::vector<std::size_t> begin;
  for (std::uint32_t m = 0; m < host.mesh_count; ++m) {
    const MeshEdges edges = hard_edges(host.meshes[m]);
    begin.push_back(hard.size());
    hard.insert(hard.end(), edges.hard.begin(), edges.hard.end());
    for (const auto& three : edges.next) next.insert(next.end(), three.begin(), three.end());
  }
  std::vector<std::uint32_t> instance_begin{0};
  for (std::uint32_t i = 0; i < host.instance_count; ++i) {
    instance_begin.push_back(instance_begin.back() + host.meshes[host.instances[i].mesh].triangle_count);
  }
  triangle_count_ = instance_begin.back();
  hard_ = DeviceBuffer<std::uint8_t>(device, hard.size());
  next_ = DeviceBuffer<std::uint32_t>(device, next.size());
  std::vector<MeshEdgesView> views;
  for (const std::size_t first : begin) views.push_back({hard_.data() + first, next_.data() + 3 * first});
  instance_begin_ = DeviceBuffer<std::uint32_t>(device, instance_begin.size());
  views_ = DeviceBuffer<MeshEdgesView>(device, views.size());
  hard_.upload(hard.data(), hard.size());
  next_.upload(next.data(), next.size());
  instance_begin_.upload(instance_begin.data(), instance_begin.size());
  views_.upload(views.data(), views.size());
  device.synchronize();  // the host copies above end here
}

std::uint64_t DevicePoints::bytes_for(std::uint32_t per_map, std::uint64_t triangles) {
  const std::uint64_t count = surface_point_count(per_map), round = point_round(count);
  const std::uint64_t sorting = triangles <= kMostSortedTriangles ? 28 * triangles : 0;
  return count * (sizeof(SurfacePoint) + sizeof(DrawnPoint)) + round * (sizeof(DrawnPoint) + 16) +
         count * sizeof(float) + std::min(count, triangles) * kDiscEdges * sizeof(DiscEdge) + triangles +
         std::max(sorting, 12 * triangles) + (1u << 20);
}

DevicePoints::DevicePoints(Device& device, const SceneView& scene, const DeviceEdges& edges, std::uint32_t per_map,
                           std::uint64_t seed) {
  CudaExecutor executor(device);
  const std::uint32_t triangles = edges.triangle_count();
  const std::uint32_t* instance_begin = edges.instance_begin();
  view_.per_map = per_map;
  view_.bounds = scene.bounds;
  const auto wanted = static_cast<std::uint32_t>(surface_point_count(per_map));
  DeviceBuffer<DrawnPoint> drawn(device, wanted);
  std::uint32_t made = 0;
  if (triangles > 0) {
    // Order.
    DeviceBuffer<std::uint32_t> sorted;
    if (triangles <= kMostSortedTriangles) {
      DeviceBuffer<std::uint64_t> keys(device, triangles);
      sorted = DeviceBuffer<std::uint32_t>(device, triangles);
      executor.for_each(triangles, MakeKeys{scene, instance_begin, keys.data(), sorted.data()});
      executor.sort_pairs(keys, sorted);
    }
    const DeviceOrder order{sorted.data(), instance_begin, scene.instance_count};

    // Areas.
    const auto chunks = static_cast<std::uint32_t>((triangles + kAreaChunk - 1) / kAreaChunk);
    DeviceBuffer<double> before(device, chunks), total(device, 1);
    executor.for_each(chunks, SumChunks{scene, order, triangles, before.data()});
    scan_areas<<<1, kScanThreads, 0, device.stream()>>>(before.data(), chunks, total.data());
    check(cudaGetLastError(), "summing areas");
    total.download(&area_, 1);

    // Points: those of a round that masks cut away are left out.
    const AreaTable<DeviceOrder> table{order, triangles, before.data(), chunks, area_};
    const auto round = static_cast<std::uint32_t>(point_round(wanted));
    const std::uint64_t most = area_ > 0 ? most_point_draws(wanted) : 0;
    DeviceBuffer<DrawnPoint> candidates(device, round);
    DeviceBuffer<std::uint32_t> kept(device, round), places(device, round);
    std::uint64_t tried = 0;
    for (; made < wanted && tried < most; tried += round) {
      executor.for_each(round, DrawPoints{scene, table, static_cast<std::uint32_t>(tried), point_stream(seed),
                                          candidates.data(), kept.data()});
      const std::uint32_t found = executor.exclusive_scan(kept.data(), places.data(), round);
      executor.for_each(round, KeepPoints{candidates.data(), kept.data(), places.data(), made, wanted, drawn.data()});
      made = std::min(wanted, made + found);
    }
    if (made < wanted && tried > 0) area_ *= static_cast<double>(made) / static_cast<double>(tried);
  }

  // Shapes.
  const float small = point_radius(area_, per_map);
  view_.largest = small * kOverlap;
  points_ = DeviceBuffer<SurfacePoint>(device, std::max(1u, made));
  radii_ = DeviceBuffer<float>(device, std::max(1u, made));
  DeviceBuffer<std::uint32_t> marks(device, std::max(1u, triangles)), numbers(device, std::max(1u, triangles));
  marks.fill_bytes(0);
  const ShapeMaker make{scene, edges.meshes(), instance_begin, drawn.data(), view_.largest, small, kPi * small * small};
  executor.for_each(made, LayOut{make, points_.data(), radii_.data(), marks.data()});
  const std::uint32_t cut = executor.exclusive_scan(marks.data(), numbers.data(), triangles);
  edges_ = DeviceBuffer<DiscEdge>(device, std::size_t{kDiscEdges} * std::max(1u, cut));
  executor.for_each(made, WriteEdges{make, numbers.data(), points_.data(), edges_.data()});
  view_.points = points_.data();
  view_.radii = radii_.data();
  view_.edges = edges_.data();
  view_.count = made;
}

}  // namespace lightcuts::cuda
