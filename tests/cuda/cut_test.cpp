#include <algorithm>
#include <cstdio>

#include "backend/backend.h"
#include "cuda/device_fixture.h"
#include "cuda/device_lights.h"
#include "cuda/film.h"
#include "cuda/packet_cut.h"
#include "cuda/picture_groups.h"
#include "cuda/receivers.h"
#include "cut/cut_scene.h"
#include "lightcuts/compare.h"
#include "lightcuts/io.h"
#include "oracle/vpl_sum.h"

namespace lightcuts::cuda {
namespace {

struct CutResult {
  std::vector<Vec3T<double>> light;
  std::vector<std::uint32_t> size;
  std::vector<float> bound;
  std::vector<std::uint8_t> at_limit;
  std::vector<test::CutNodes> cuts;  ///< by pixel
  CutCounts counts;
};

/// Ways to cut: groups share one; each pixel has its own; crews for the larger ones; large crews for all but the
/// smallest.
struct Way {
  bool own_cuts = false;
  std::uint32_t heavy_work = 16384;
};
std::vector<Way> ways() {
  if (reduced()) return {{true, 16384}, {false, 64}};
  return {{false, 16384}, {true, 16384}, {false, 1024}, {true, 1024}, {false, 64}, {true, 64}};
}

class Cuts : public OnDevice {
 protected:
  static constexpr float kMinDistance = 0.05f;

  CutResult cut(const Lights& lights, const LightTrees& trees, const Receivers& at, float error,
                std::uint32_t max_cut = 0, Way way = {}) {
    const DeviceLights sent = send_lights(*device, lights);
    const DeviceTrees sent_trees = upload_light_trees(*device, trees, sent);
    const auto position = send(*device, at.position), ns = send(*device, at.ns), ng = send(*device, at.ng),
               albedo = send(*device, at.albedo);
    const PixelView pixels{position.data(), ns.data(), ng.data(), albedo.data(), nullptr, nullptr};
    const std::size_t n = at.position.size();
    const auto light = cleared<Vec3T<double>>(*device, n);
    const auto lost = cleared<double>(*device, n);
    const auto rays = cleared<std::uint32_t>(*device, n), size = cleared<std::uint32_t>(*device, n);
    const auto bound = cleared<float>(*device, n);
    const auto at_limit = cleared<std::uint8_t>(*device, n);
    const auto counts = cleared<CutCounts>(*device, 1);
    constexpr std::uint32_t kMostListed = 20'000'000;
    const DeviceBuffer<ListedNode> listed(*device, kMostListed);
    const auto listed_count = cleared<std::uint32_t>(*device, 1);
    CutView view{size.data(), bound.data(), at_limit.data(), counts.data(), {}};
    view.listing = {listed.data(), listed_count.data(), kMostListed, way.own_cuts};
    const PictureGroups groups(*device, pixels, at.tiles());
    CutJob job{sent_trees.view(),
               {sent.vpls.data(), sent.points.data(), sent.directionals.data(), sent.vpl_count, sent.point_count,
                sent.directional_count},
               kMinDistance,
               error,
               max_cut,
               {way.heavy_work, way.heavy_work / 4, 4 * way.heavy_work}};
    job.groups = groups.pixels();
    cut_by_packets(*device, {}, pixels, job, false, groups.list(), {light.data(), lost.data(), rays.data()}, view);
    CutResult result{fetch(light), fetch(size), fetch(bound), fetch(at_limit), {}, fetch(counts)[0]};
    const std::uint32_t found = fetch(listed_count)[0];
    EXPECT_LT(found, kMostListed);
    std::vector<ListedNode> nodes(found);
    listed.download(nodes.data(), found);
    result.cuts = last_walks(nodes, n);
    return result;
  }

  static test::CheckedPoint point(const Receivers& at, std::size_t i) {
    return {at.position[i], at.ns[i], at.ng[i], at.albedo[i], kMinDistance};
  }

  /// Each light once in every cut, the promise kept in double precision, light and size as the cut says.
  static void expect_promise(const Lights& lights, const LightTrees& trees, const Receivers& at, const CutResult& got,
                             double error, std::size_t step) {
    for (std::size_t i = 0; i < at.position.size(); i += step) {
      if (at.ns[i] == Vec3{}) {
        EXPECT_EQ(got.size[i], 0u);
        continue;
      }
      const test::CutNodes& cut = got.cuts[i];
      ASSERT_EQ(cut[0].size() + cut[1].size() + cut[2].size(), got.size[i]) << "pixel " << i;
      ASSERT_TRUE(test::holds_each_light_once(trees.vpls, cut[0])) << "pixel " << i;
      ASSERT_TRUE(test::holds_each_light_once(trees.points, cut[1])) << "pixel " << i;
      ASSERT_TRUE(test::holds_each_light_once(trees.directionals, cut[2])) << "pixel " << i;
      const test::DoubleCheck check = test::check_again(lights, trees, cut, point(at, i));
      EXPECT_LE(check.largest, error * check.total) << "pixel " << i;
      EXPECT_LE(check.largest, static_cast<double>(got.bound[i]) * check.total * (1 + 1e-4) + 1e-30) << "pixel " << i;
      const double light = test::luminance_of(
          at.albedo[i],
          {static_cast<float>(got.light[i].x), static_cast<float>(got.light[i].y), static_cast<float>(got.light[i].z)});
      EXPECT_NEAR(light, check.total, 2e-5 * check.total + 1e-12) << "pixel " << i;
      EXPECT_LE(std::abs(check.total - check.exact), check.bound_sum * (1 + 1e-6) + 1e-12);
      EXPECT_FALSE(got.at_limit[i]);
    }
  }
};

TEST_F(Cuts, KeepTheirPromiseForAllKindsOfLight) {
  const int many = reduced() ? 301 : 3001;
  for (const auto& [vpls, points, directionals] :
       {std::array{1, 0, 0}, std::array{0, 1, 0}, std::array{0, 0, 1}, std::array{33, 0, 0}, std::array{many, 0, 0},
        std::array{0, 257, 64}, std::array{many / 2, 100, 31}}) {
    const Lights lights = test::mixed_lights(7, vpls, points, directionals);
    const LightTrees trees = build_light_trees(lights, 3, {}, {});
    const Receivers at(8, reduced() ? 6 : 40);
    for (const Way& way : ways()) {
      const float error = way.own_cuts ? 0.02f : 0.01f;
      const CutResult got = cut(lights, trees, at, error, 0, way);
      expect_promise(lights, trees, at, got, static_cast<double>(error), 7);
      std::printf("  %d+%d+%d lights, %s, %u: %.1f walks a group, %.1f groups a tile\n", vpls, points, directionals,
                  way.own_cuts ? "own cuts" : "group", way.heavy_work,
                  static_cast<double>(got.counts.walks) / static_cast<double>(got.counts.groups),
                  static_cast<double>(got.counts.groups) / at.tiles());
    }
  }
}

TEST_F(Cuts, OfChainsKeepTheirPromiseInABoundedStack) {
  // A tree as deep as it has lights.
  Lights lights = test::mixed_lights(9, reduced() ? 150 : 3000, 0, 0);
  LightTree chain = build_light_trees(lights, 3, {}, {}).vpls;
  std::vector<LightNode> leaves;
  for (const LightNode& node : chain.nodes) {
    if (node.is_leaf()) leaves.push_back(node);
  }
  LightTree deep;
  deep.nodes.resize(2 * leaves.size() - 1);
  LightNode below = leaves[0];
  std::size_t place = deep.nodes.size();
  for (std::size_t i = 1; i < leaves.size(); ++i) {
    place -= 2;
    deep.nodes[place] = below;
    deep.nodes[place + 1] = leaves[i];
    LightNode node = below;
    node.box = extend(below.box, leaves[i].box);
    const DirectionCone cone =
        unite(DirectionCone{below.axis, below.cos_half_angle}, DirectionCone{leaves[i].axis, leaves[i].cos_half_angle});
    node.axis = cone.axis;
    node.cos_half_angle = cone.cos_half_angle;
    node.intensity = below.intensity + leaves[i].intensity;
    node.first_child = static_cast<std::uint32_t>(place);
    node.leaf_count = static_cast<std::uint32_t>(i + 1);
    below = node;
  }
  deep.nodes[0] = below;
  deep.depth = static_cast<std::uint32_t>(leaves.size());
  LightTrees trees;
  trees.vpls = deep;
  const Receivers at(10, reduced() ? 2 : 6);
  for (const Way& way : ways()) {
    const CutResult got = cut(lights, trees, at, 0.02f, 0, way);
    expect_promise(lights, trees, at, got, 0.02, 5);
  }
}

TEST_F(Cuts, StayBelowTheLargestAllowed) {
  const Lights lights = test::mixed_lights(11, reduced() ? 600 : 4000, 10, 10);
  const LightTrees trees = build_light_trees(lights, 3, {}, {});
  const Receivers at(12, reduced() ? 2 : 20);
  for (const Way& way : ways()) {
    const CutResult got = cut(lights, trees, at, 0.001f, 50, way);
    for (std::size_t i = 0; i < got.size.size(); ++i) {
      EXPECT_LE(got.size[i], 50u);
      if (got.size[i] > 0 && max_component(at.albedo[i]) > 0 && got.light[i].x > 0) {
        EXPECT_TRUE(got.at_limit[i]);
      }
    }
  }
}

TEST_F(Cuts, AreTheSameTwice) {
  const Lights lights = test::mixed_lights(13, reduced() ? 500 : 2000, 30, 10);
  const LightTrees trees = build_light_trees(lights, 3, {}, {});
  const Receivers at(14, reduced() ? 3 : 100);
  for (const Way& way : ways()) {
    const CutResult a = cut(lights, trees, at, 0.02f, 0, way), b = cut(lights, trees, at, 0.02f, 0, way);
    EXPECT_EQ(a.size, b.size);
    EXPECT_EQ(a.bound, b.bound);
    for (std::size_t i = 0; i < a.light.size(); ++i) EXPECT_TRUE(a.light[i] == b.light[i]);
  }
}

// --- Whole pictures ---

class CutPictures : public OnDevice, public testing::WithParamInterface<const char*> {
 protected:
  static ShadeOptions options(Method method, Visibility visibility) {
    ShadeOptions o;
    o.method = method;
    o.visibility = visibility;
    return o;
  }
};

TEST_P(CutPictures, AgreeWithAllLightsAndWithTheCpusCuts) {
  Scene scene = make_builtin_scene(GetParam());
  validate(scene);
  const auto cpu = make_cpu_backend(0), gpu = make_cuda_backend(0, 0);
  for (Backend* backend : {cpu.get(), gpu.get()}) backend->set_scene(scene, {});
  const Camera camera = select_camera(scene, "");
  VplOptions vpls;
  vpls.count = reduced() ? 300 : 3000;
  const auto shade = [&](Backend& backend, int width, int height, const ShadeOptions& how, Statistics& statistics) {
    const int part = reduced() ? 3 : 1;
    return backend.shade(camera, width / part, height / part, how, 0, statistics, {}).image;
  };
  cpu->trace_vpls(vpls, {});
  gpu->set_lights(cpu->lights());
  cpu->build_light_tree({}, {});
  gpu->build_light_tree({}, {});
  for (const Visibility visibility : {Visibility::none, Visibility::rays}) {
    Statistics of_cpu, of_gpu, of_all, again;
    const Image cut_by_cpu = shade(*cpu, 101, 67, options(Method::lightcuts, visibility), of_cpu);
    const Image cut = shade(*gpu, 101, 67, options(Method::lightcuts, visibility), of_gpu);
    const Image all = shade(*gpu, 101, 67, options(Method::instant_radiosity, visibility), of_all);
    const Comparison to_all = compare(cut, all), cpu_to_all = compare(cut_by_cpu, all);
    std::printf("  %s, %s: cut %.0f (CPU %.0f), relmse %.2e (CPU %.2e), signed %.3f %% (CPU %.3f %%), rays %.1f M\n",
                GetParam(), visibility == Visibility::rays ? "rays" : "none", of_gpu.cut.mean, of_cpu.cut.mean,
                to_all.relmse, cpu_to_all.relmse, 100 * to_all.signed_relative_error,
                100 * cpu_to_all.signed_relative_error, static_cast<double>(of_gpu.rays) / 1e6);
    EXPECT_LT(to_all.relmse, std::max(2e-3, 1.5 * cpu_to_all.relmse));
    EXPECT_LT(of_gpu.cut.mean, 2.5 * of_cpu.cut.mean);
    EXPECT_EQ(of_gpu.cut.at_limit, 0);
    EXPECT_NEAR(of_gpu.clamped, of_cpu.clamped, 0.02);
    // The heap takes the CPU's decisions.
    ShadeOptions heap = options(Method::lightcuts, visibility);
    heap.cut = CutWalk::heap;
    Statistics of_cpu_heap, of_gpu_heap;
    gpu->set_light_tree(cpu->light_trees());
    const Image heap_a = shade(*cpu, 51, 33, heap, of_cpu_heap);
    const Image heap_b = shade(*gpu, 51, 33, heap, of_gpu_heap);
    gpu->build_light_tree({}, {});
    const double heaps = compare(heap_b, heap_a).relmse;
    std::printf("    heaps: cut %.1f (CPU %.1f), relmse between both %.2e\n", of_gpu_heap.cut.mean,
                of_cpu_heap.cut.mean, heaps);
    EXPECT_LT(heaps, 1e-5);
    EXPECT_NEAR(of_gpu_heap.cut.mean / of_cpu_heap.cut.mean, 1, 0.01);
    ASSERT_NE(find_channel(cut, "cut.size"), nullptr);
    ASSERT_NE(find_channel(cut, "cut.bound"), nullptr);
    for (const float bound : find_channel(cut, "cut.bound")->values) EXPECT_LE(bound, 0.02f);
    const Image twice = shade(*gpu, 101, 67, options(Method::lightcuts, visibility), again);
    for (std::size_t k = 0; k < cut.channels.size(); ++k) EXPECT_EQ(cut.channels[k].values, twice.channels[k].values);

    // With hardly any error allowed, cuts are sums over all lights, but for the order.
    ShadeOptions strict = options(Method::lightcuts, visibility);
    strict.error = 1e-6f;
    EXPECT_LT(compare(shade(*gpu, 51, 33, strict, again),
                      shade(*gpu, 51, 33, options(Method::instant_radiosity, visibility), again))
                  .relmse,
              1e-7);
  }
}

TEST_P(CutPictures, HaveCutsAsLargeAsOverTheCpusTree) {
  if (reduced()) GTEST_SKIP() << "compares sizes, which are those of many lights";
  Scene scene = make_builtin_scene(GetParam());
  validate(scene);
  const auto cpu = make_cpu_backend(0), gpu = make_cuda_backend(0, 0);
  for (Backend* backend : {cpu.get(), gpu.get()}) backend->set_scene(scene, {});
  VplOptions vpls;
  vpls.count = 50000;
  gpu->trace_vpls(vpls, {});
  cpu->set_lights(gpu->lights());
  const Camera camera = select_camera(scene, "");
  double mean[3], by_packets[3];
  gpu->build_light_tree({}, {});
  for (int k = 0; k < 3; ++k) {
    if (k > 0) {
      cpu->build_light_tree({k == 1 ? TreeBuilder::ploc : TreeBuilder::agglomerative, Metric::walter, 1}, {});
      gpu->set_light_tree(cpu->light_trees());
    }
    // By heaps: what packets choose depends on how well they guess a total, too.
    ShadeOptions by_heaps = options(Method::lightcuts, Visibility::none);
    by_heaps.cut = CutWalk::heap;
    Statistics statistics;
    gpu->shade(camera, 100, 100, by_heaps, 0, statistics, {});
    mean[k] = statistics.cut.mean;
    gpu->shade(camera, 200, 200, options(Method::lightcuts, Visibility::none), 0, statistics, {});
    by_packets[k] = statistics.cut.mean;
  }
  std::printf("  %s: mean cut %.1f over the GPU's tree, %.1f over the CPU's, %.1f over the agglomerative one\n",
              GetParam(), mean[0], mean[1], mean[2]);
  std::printf("  by packets: %.1f, %.1f, %.1f\n", by_packets[0], by_packets[1], by_packets[2]);
  EXPECT_LT(mean[0] / mean[1], 1.03);
  EXPECT_LT(by_packets[0] / by_packets[1], 1.25);
}
INSTANTIATE_TEST_SUITE_P(Scenes, CutPictures, testing::Values("cornell", "study", "interior", "lamps?count=100"));

}  // namespace
}  // namespace lightcuts::cuda
