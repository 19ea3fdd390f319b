#include "kernels/build_wide_bvh.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/serial_executor.h"
#include "oracle/brute_force.h"

namespace lightcuts {
namespace {

/// Flat scene of its own: meshes, instances and the view over them.
struct SmallScene {
  std::vector<std::vector<Vec3>> positions;
  std::vector<std::vector<std::array<std::uint32_t, 3>>> triangles;
  std::vector<MeshView> meshes;
  std::vector<InstanceView> instances;
  std::vector<MaterialView> materials{1};
  std::vector<std::uint32_t> instance_begin{0};
  SceneView view;

  void finish() {
    for (std::size_t m = 0; m < positions.size(); ++m) {
      MeshView mesh;
      mesh.positions = positions[m].data();
      mesh.triangles = reinterpret_cast<const std::uint32_t(*)[3]>(triangles[m].data());
      mesh.triangle_count = static_cast<std::uint32_t>(triangles[m].size());
      meshes.push_back(mesh);
    }
    for (const InstanceView& instance : instances) {
      for (const Vec3& p : positions[instance.mesh])
        view.bounds = extend(view.bounds, transform_point(instance.world_from_object, p));
      instance_begin.push_back(instance_begin.back() + meshes[instance.mesh].triangle_count);
    }
    view.meshes = meshes.data();
    view.mesh_count = static_cast<std::uint32_t>(meshes.size());
    view.instances = instances.data();
    view.instance_count = static_cast<std::uint32_t>(instances.size());
    view.materials = materials.data();
    view.material_count = 1;
    view.diagonal = diagonal(view.bounds);
  }
};

Vec3 random_point(std::mt19937& rng, float lo, float hi) {
  std::uniform_real_distribution<float> u(lo, hi);
  return {u(rng), u(rng), u(rng)};
}

/// Triangles of all sizes, some long and thin, some axis-aligned and so with flat boxes.
std::unique_ptr<SmallScene> triangle_soup(std::uint32_t count, unsigned seed) {
  auto scene = std::make_unique<SmallScene>();
  std::mt19937 rng(seed);
  scene->positions.resize(1);
  scene->triangles.resize(1);
  for (std::uint32_t i = 0; i < count; ++i) {
    const float size = std::exp(std::uniform_real_distribution<float>(-5, 1)(rng));
    const Vec3 p = random_point(rng, -5, 5);
    for (int corner = 0; corner < 3; ++corner) {
      Vec3 q = p + random_point(rng, -size, size);
      if (i % 5 == 0) q.y = p.y;
      scene->positions[0].push_back(q);
    }
    scene->triangles[0].push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  scene->instances.push_back({});
  Affine moved;
  moved.x = {0, 0.5f, 0};
  moved.y = {-0.5f, 0, 0};
  moved.origin = {3, 2, 1};
  scene->instances.push_back({moved, 0});
  scene->finish();
  return scene;
}

/// Every triangle asked, in double.
Hit brute_force(const SmallScene& scene, const Ray& ray) {
  Hit best;
  double best_t = ray.t_max;
  for (std::uint32_t i = 0; i < scene.view.instance_count; ++i) {
    const InstanceView& instance = scene.instances[i];
    const MeshView& mesh = scene.meshes[instance.mesh];
    for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
      const auto corner = [&](int k) {
        return oracle::wide(transform_point(instance.world_from_object, mesh.positions[mesh.triangles[t][k]]));
      };
      const oracle::Meeting met =
          oracle::meet(oracle::wide(ray.origin), oracle::wide(ray.direction), corner(0), corner(1), corner(2));
      if (!met.inside || met.t < ray.t_min || met.t >= best_t) continue;
      best_t = met.t;
      best = {static_cast<float>(met.t), static_cast<float>(met.u), static_cast<float>(met.v), i, t};
    }
  }
  return best;
}

class WideBvhSizes : public testing::TestWithParam<std::uint32_t> {};

TEST_P(WideBvhSizes, HitsWhatBruteForceHits) {
  const auto scene = triangle_soup(GetParam(), GetParam());
  SerialExecutor exec;
  const auto bvh = build_wide_bvh(exec, scene->view, scene->instance_begin);
  std::mt19937 rng(7);
  int hits = 0, disagreements = 0;
  const int rays = 4000;
  for (int i = 0; i < rays; ++i) {
    Ray ray;
    ray.origin = random_point(rng, -6, 6);
    ray.direction = random_point(rng, -1, 1);
    if (i % 3 == 0) {  // aimed at a triangle
      const auto& positions = scene->positions[0];
      const std::size_t first = 3 * (rng() % (positions.size() / 3));
      ray.direction = (positions[first] + positions[first + 1] + positions[first + 2]) / 3.0f - ray.origin;
    }
    if (i % 7 == 0) ray.direction.y = 0;
    if (i % 11 == 0) ray.direction = {0, 0, i % 2 ? 1.0f : -1.0f};
    const Hit expected = brute_force(*scene, ray);
    const Hit found = traverse<false>(bvh.view(), ray, AcceptAll{});
    const bool blocked = traverse<true>(bvh.view(), ray, AcceptAll{}).valid();
    hits += expected.valid();
    ASSERT_EQ(blocked, found.valid());
    if (expected.valid() != found.valid() || expected.triangle != found.triangle ||
        (expected.valid() && std::abs(expected.t - found.t) > 1e-4f * expected.t)) {
      ++disagreements;
    }
  }
  EXPECT_GT(hits, rays / 10);
  EXPECT_LE(disagreements, 4);  // rays within rounding of an edge
}

TEST_P(WideBvhSizes, HoldsEveryTriangleOnce) {
  const auto scene = triangle_soup(GetParam(), 3);
  SerialExecutor exec;
  const auto bvh = build_wide_bvh(exec, scene->view, scene->instance_begin);
  const std::uint32_t n = scene->instance_begin.back();
  const auto count = [&](const WideBvhView& view, const WideNode* nodes) {
    std::vector<int> seen(n, 0), reached(bvh.node_count, 0);
    reached[0] = 1;
    for (std::uint32_t i = 0; i < bvh.node_count; ++i) {
      const WideNode& node = nodes[i];
      for (int c = 0; c < std::popcount(node.node_mask); ++c) ++reached[node.child_base + c];
      for (int t = 0; t < std::popcount(node.triangle_mask); ++t) {
        const LeafTriangle& leaf = view.triangles[node.triangle_base + t];
        ++seen[scene->instance_begin[leaf.instance] + leaf.triangle];
      }
      for (int c = 0; c < 8; ++c) {
        EXPECT_FALSE((node.node_mask >> c & 1) != 0 && (node.triangle_mask >> 3 * c & 7) != 0);
      }
    }
    for (std::uint32_t i = 0; i < n; ++i) EXPECT_EQ(seen[i], 1) << i;
    for (std::uint32_t i = 0; i < bvh.node_count; ++i) EXPECT_EQ(reached[i], 1) << i;
  };
  count(bvh.view(), bvh.nodes.data());
  count(bvh.view(), bvh.shadow_nodes.data());
}

INSTANTIATE_TEST_SUITE_P(Counts, WideBvhSizes, testing::Values(1, 2, 3, 4, 5, 8, 33, 257, 2000));

TEST(WideBvh, LetsNoRayThroughAClosedMesh) {
  // A finely divided cube: rays from the inside towards its edges and vertices must all hit.
  auto scene = std::make_unique<SmallScene>();
  scene->positions.resize(1);
  scene->triangles.resize(1);
  const int cells = 12;
  for (int face = 0; face < 6; ++face) {
    const auto base = static_cast<std::uint32_t>(scene->positions[0].size());
    for (int i = 0; i <= cells; ++i) {
      for (int j = 0; j <= cells; ++j) {
        const float a = 2.0f * static_cast<float>(i) / cells - 1, b = 2.0f * static_cast<float>(j) / cells - 1;
        const float c = face % 2 ? 1.0f : -1.0f;
        scene->positions[0].push_back(face < 2 ? Vec3{a, b, c} : face < 4 ? Vec3{a, c, b} : Vec3{c, a, b});
      }
    }
    for (std::uint32_t i = 0; i < cells; ++i) {
      for (std::uint32_t j = 0; j < cells; ++j) {
        const std::uint32_t v = base + i * (cells + 1) + j;
        scene->triangles[0].push_back({v, v + 1, v + cells + 2});
        scene->triangles[0].push_back({v, v + cells + 2, v + cells + 1});
      }
    }
  }
  scene->instances.push_back({});
  scene->finish();
  SerialExecutor exec;
  const auto bvh = build_wide_bvh(exec, scene->view, scene->instance_begin);
  std::mt19937 rng(11);
  for (int i = 0; i < 200000; ++i) {
    const auto& corners = scene->triangles[0][rng() % scene->triangles[0].size()];
    const Vec3 p = scene->positions[0][corners[0]], q = scene->positions[0][corners[1 + rng() % 2]];
    const float s = static_cast<float>(rng() % 1025) / 1024;
    Ray ray;
    ray.origin = random_point(rng, -0.9f, 0.9f);
    ray.direction = p + (q - p) * s - ray.origin;
    ASSERT_TRUE(traverse<true>(bvh.view(), ray, AcceptAll{}).valid()) << i;
  }
}

}  // namespace
}  // namespace lightcuts
