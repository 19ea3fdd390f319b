#include <gtest/gtest.h>

#include <ctime>
#include <set>

#include "backend/find_occluders.h"
#include "backend/scene_arrays.h"
#include "cpu/simd/isa.h"
#include "cpu/visibility.h"
#include "cpu_shade/lit_backend.h"
#include "cpu_shade/rooms.h"
#include "cut/cut_scene.h"
#include "kernels/offset_point.h"
#include "lightcuts/compare.h"

namespace lightcuts::test {
namespace {

/// Two rooms, 4 x 2 x 2 m together, with a wall between them that has a doorway; a lamp in the far one.
Scene two_rooms() {
  Scene scene = closed_room({0.7f, 0.7f, 0.7f});
  for (Mesh& mesh : scene.meshes) {
    for (Vec3& p : mesh.positions) p.x = p.x * 2;
  }
  Material lamp;
  lamp.emission = {8, 8, 8};
  scene.materials.push_back(lamp);
  add_rectangle(scene, {-1.5f, 0.9f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 1);
  add_rectangle(scene, {0, -1, -1}, {0, 2, 0}, {0, 0, 1.4f}, 0);         // beside the doorway
  add_rectangle(scene, {0, 0.6f, 0.4f}, {0, 0.4f, 0}, {0, 0, 0.6f}, 0);  // above it
  return scene;
}

TEST(FindOccluders, MergesTheTrianglesOfARectangle) {
  const Scene scene = two_rooms();
  const SceneArrays arrays(scene);
  const std::vector<Occluder> found = find_occluders(arrays.view(), 100);
  ASSERT_EQ(found.size(), 9u);
  EXPECT_FLOAT_EQ(found[0].area, 8);
  EXPECT_FLOAT_EQ(found[8].area, 0.24f);
  for (const Occluder& o : found) {
    Vec3 sum;
    for (const Vec3& corner : o.corner) sum += corner;
    for (int i = 0; i < kOccluderCorners; ++i) {
      EXPECT_NEAR(length(o.inward[i]), 1, 1e-6f);
      EXPECT_NEAR(dot(o.inward[i], o.normal), 0, 1e-6f);
      EXPECT_GT(dot(o.inward[i], sum * 0.25f - o.corner[i]), 0.01f);
      EXPECT_NEAR(dot(o.normal, o.corner[i] - o.corner[0]), 0, 1e-6f);
    }
  }
  EXPECT_EQ(find_occluders(arrays.view(), 3).size(), 3u);
}

TEST(FindOccluders, LeavesOutMasksAndMergesWholeGrids) {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[1].alpha_mode = AlphaMode::mask;
  Mesh grid;
  for (int y = 0; y <= 4; ++y) {
    for (int x = 0; x <= 4; ++x) grid.positions.push_back({static_cast<float>(x), static_cast<float>(y), 0});
  }
  for (std::uint32_t y = 0; y < 4; ++y) {
    for (std::uint32_t x = 0; x < 4; ++x) {
      const std::uint32_t i = 5 * y + x;
      grid.triangles.push_back({i, i + 1, i + 6});
      // Turned the other way: a triangle blocks from both sides.
      grid.triangles.push_back({i, i + 5, i + 6});
    }
  }
  scene.meshes.push_back(grid);
  scene.instances.push_back({"", 0, {}});
  add_rectangle(scene, {0, 0, 5}, {9, 0, 0}, {0, 9, 0}, 1);
  const SceneArrays arrays(scene);
  const std::vector<Occluder> found = find_occluders(arrays.view(), 100);
  float area = 0;
  for (const Occluder& o : found) area += o.area;
  EXPECT_FLOAT_EQ(area, 16);
  EXPECT_LE(found.size(), 4u);
}

TEST(FindOccluders, ManyTrianglesOnOneEdgeTakeLittleTime) {
  Scene scene;
  scene.materials.resize(1);
  Mesh pile;
  pile.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  pile.triangles.assign(16000, {0, 1, 2});
  scene.meshes.push_back(pile);
  scene.instances.push_back({"", 0, {}});
  const SceneArrays arrays(scene);
  const std::clock_t start = std::clock();  // processor time: other programs do not count
  EXPECT_EQ(find_occluders(arrays.view(), 100).size(), 100u);
  EXPECT_LT(std::clock() - start, 2 * CLOCKS_PER_SEC);  // half a minute when all pairs were tried
}

/// Every node that is said to be hidden is asked for by rays, light by light.
class RayAsker final : public CutListener {
 public:
  RayAsker(const CutContext& context, const RayTracer& tracer, const Tile& tile)
      : context_(context), tracer_(tracer), tile_(tile) {}
  void chosen(LightKind kind, std::uint32_t node, const ReceiverGroup<float>&,
              std::span<const std::uint8_t> pixels) override {
    for (const std::uint8_t pixel : pixels) nodes[pixel][static_cast<std::size_t>(kind)].push_back(node);
  }
  void hidden(LightKind kind, std::uint32_t node, const ReceiverGroup<float>& group,
              std::span<const std::uint8_t> pixels) override {
    chosen(kind, node, group, pixels);
    ++hidden_nodes;
    const LightTree& tree = tree_of(context_.trees, kind);
    std::vector<std::uint32_t> pending{node};
    while (!pending.empty()) {
      const LightNode& top = tree.nodes[pending.back()];
      pending.pop_back();
      if (!top.is_leaf()) {
        pending.insert(pending.end(), {top.first_child, top.second_child()});
        continue;
      }
      for (const std::uint8_t pixel : pixels) ask(kind, top.representative, pixel);
    }
  }

  std::array<CutNodes, kTilePixels> nodes;
  int hidden_nodes = 0, rays = 0, seen = 0;

 private:
  void ask(LightKind kind, std::uint32_t light, std::uint8_t pixel) {
    const ReceiverPacket& r = tile_.packets[pixel / kPacketSize].receivers;
    const int lane = pixel % kPacketSize;
    const Vec3 from = get_lane(r.position, lane), ns = get_lane(r.ns, lane);
    Ray ray{from, 0, {}, 1};
    if (kind == LightKind::vpl) {
      const Vpl& vpl = context_.lights.vpls[light];
      ray.direction = offset_point(vpl.position, vpl.axis) - from;
      if (dot(vpl.axis, ray.direction) >= 0) return;  // shines away, so its ray may be blocked or not
    } else if (kind == LightKind::point) {
      ray.direction = context_.lights.points[light].position - from;
    } else {
      ray.direction = -context_.lights.directionals[light].direction;
      ray.t_max = kInfinity;
    }
    if (dot(ns, ray.direction) <= 0) return;
    ++rays;
    if (!tracer_.occluded(ray)) ++seen;
  }

  const CutContext& context_;
  const RayTracer& tracer_;
  const Tile& tile_;
};

struct Counts {
  int hidden_nodes = 0, rays = 0;
};

/// Cuts some tiles of a picture and checks what they call hidden.
Counts check_hidden(Scene scene, std::uint64_t vpls, int side, int step) {
  LitBackend lit(std::move(scene), vpls);
  const Camera camera = select_camera(lit.scene, "");
  const SceneArrays arrays(lit.scene);
  const RayTracer tracer(arrays.view());
  const EmitterTable emitters(arrays);
  const LightSet set = make_light_set(lit.backend.lights());
  const LightTrees& trees = lit.backend.light_trees();
  const RayVisibility rays(tracer);
  LightMarks marks(trees);
  const std::vector<Occluder> occluders = find_occluders(arrays.view(), kMostOccluders);
  const CutContext context{
      trees, set,
      &rays, 1e-4f,
      0.01f, 0,
      marks, occluder_view(occluders.data(), static_cast<std::uint32_t>(occluders.size()), arrays.view().bounds)};
  const Frontier frontier = make_frontier(context, 48);
  const GroupTuning tuning{
      .extent = 0.05f, .cosine = 0.8f, .pixels = 64, .first_factor = 3, .level_ratio = 1.2f, .umbras = 32};
  const View view = make_view(camera, side, side, 1, 1, true);
  Counts counts;
  int all = 0, isa_index = 0;
  for (int y = 0; y < side; y += step) {
    for (int x = 0; x < side; x += step) {
      const Tile tile = trace_tile(view, x, y, 0, arrays.view(), tracer, emitters.view());
      RayAsker asker(context, tracer, tile);
      CutScratch scratch;
      TileLight out;
      const std::vector<Isa> isas = available_isas();
      const Isa isa = isas[static_cast<std::size_t>(isa_index++) % isas.size()];
      cut_pixels({context, frontier, cut_kernels(isa), shade_kernels(isa), tuning, &asker}, tile.packets, scratch, out);
      for (int pixel = 0; pixel < kTilePixels; ++pixel) {
        const SurfacePacket& packet = tile.packets[static_cast<std::size_t>(pixel / kPacketSize)];
        if ((packet.receivers.active >> pixel % kPacketSize & 1u) == 0) continue;
        EXPECT_TRUE(holds_each_light_once(trees.vpls, asker.nodes[static_cast<std::size_t>(pixel)][0]));
        EXPECT_TRUE(holds_each_light_once(trees.points, asker.nodes[static_cast<std::size_t>(pixel)][1]));
        EXPECT_TRUE(holds_each_light_once(trees.directionals, asker.nodes[static_cast<std::size_t>(pixel)][2]));
      }
      EXPECT_EQ(asker.seen, 0) << x << " " << y;
      counts.hidden_nodes += asker.hidden_nodes;
      counts.rays += asker.rays;
      ++all;
    }
  }
  return counts;
}

Scene seen_from(Scene scene, Vec3 from, Vec3 to) {
  scene.cameras.push_back(look_at(from, to, 1.4f));
  return scene;
}

TEST(HiddenLights, NoRayReachesThem) {
  const Counts rooms = check_hidden(seen_from(two_rooms(), {1.9f, 0.5f, -0.8f}, {0.3f, -0.6f, 0.5f}), 3000, 64, 16);
  EXPECT_GT(rooms.hidden_nodes, 100);
  EXPECT_GT(rooms.rays, 10'000);
  for (const char* name : {"interior", "study"}) {
    const Counts counts = check_hidden(make_builtin_scene(name), 1500, 96, 32);
    EXPECT_GT(counts.rays, 0) << name;
  }
}

TEST(HiddenLights, OfTheSkyToo) {
  Scene scene = seen_from(closed_room({0.7f, 0.7f, 0.7f}), {0.9f, 0, 0.9f}, {-1, 0, -1});
  scene.meshes[1].positions = {{-0.3f, 1, -0.3f}, {0.3f, 1, -0.3f}, {0.3f, 1, 0.3f}, {-0.3f, 1, 0.3f}};  // no ceiling
  scene.environment = Environment{};
  const Counts counts = check_hidden(scene, 2000, 64, 16);
  EXPECT_GT(counts.hidden_nodes, 50);
  EXPECT_GT(counts.rays, 1000);
}

TEST(HiddenLights, MakeCutsSmallerAndLeaveThePictureAlone) {
  LitBackend lit(seen_from(two_rooms(), {1.9f, 0.5f, -0.8f}, {0.3f, -0.6f, 0.5f}), 2000);
  const Camera camera = select_camera(lit.scene, "");
  const Image all = lit.shade(camera, 32, 32, {});
  ShadeOptions cuts;
  cuts.method = Method::lightcuts;
  cuts.cut = CutWalk::heap;
  lit.shade(camera, 32, 32, cuts);
  const double mean_of_heap = lit.statistics.cut.mean;
  cuts.cut = CutWalk::packet;
  const Comparison c = compare(lit.shade(camera, 32, 32, cuts), all);
  EXPECT_LE(c.mean_relative_error, 0.015);
  EXPECT_LE(c.p99_relative_error, 0.05);
  EXPECT_LT(lit.statistics.cut.mean, 0.8 * mean_of_heap);
}

}  // namespace
}  // namespace lightcuts::test
