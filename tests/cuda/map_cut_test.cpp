// Cuts with shadow maps that are made on demand, on a GPU: against the CPU, against the sum over all lights, and in
// double precision.

#include <algorithm>
#include <cstdio>

#include "backend/backend.h"
#include "backend/emitter_table.h"
#include "cuda/device_fixture.h"
#include "cuda/device_lights.h"
#include "cuda/device_scene.h"
#include "cuda/map_rounds.h"
#include "cuda/packet_cut_by_maps.h"
#include "cuda/picture_groups.h"
#include "cuda/receivers.h"
#include "lightcuts/compare.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"

namespace lightcuts::cuda {
namespace {

Scene valid(const std::string& name) {
  Scene scene = make_builtin_scene(name);
  validate(scene);
  return scene;
}

void expect_same_planes(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    EXPECT_EQ(a.channels[c].values, b.channels[c].values) << a.channels[c].name;
  }
}

/// Pictures by cuts with maps.
class CutsByMaps : public OnDevice, public testing::WithParamInterface<const char*> {
 protected:
  static constexpr int kWidth = 61, kHeight = 43;

  void open(std::uint64_t count, bool with_cpu) {
    scene = valid(GetParam());
    gpu = make_cuda_backend(0, 0);
    gpu->set_scene(scene, {});
    VplOptions vpls;
    vpls.count = count;
    gpu->trace_vpls(vpls, {});
    gpu->build_light_tree({}, {});
    if (with_cpu) {
      cpu = make_cpu_backend(0);
      cpu->set_scene(scene, {});
      cpu->set_lights(gpu->lights());
      cpu->set_light_tree(gpu->light_trees());
    }
    options.visibility = Visibility::ism;
    options.ism_size = 32;
    options.ism_points = 1000;
  }
  Image shade(Backend& backend, Method method, Statistics& statistics, std::uint64_t memory = 0) {
    options.method = method;
    statistics = {};
    return backend.shade(select_camera(scene, ""), kWidth, kHeight, options, memory, statistics, {}).image;
  }

  Scene scene;
  ShadeOptions options;
  std::unique_ptr<Backend> cpu, gpu;
};

TEST_P(CutsByMaps, AreNearStricterCutsAndHeapsNearTheSumOverAllLights) {
  for (const std::uint64_t count : {50, reduced() ? 500 : 20000}) {
    open(count, false);
    Statistics of_cuts, of_sum, of_heaps, again;
    const Image cuts = shade(*gpu, Method::lightcuts, of_cuts);
    const Image repeated = shade(*gpu, Method::lightcuts, again);  // with the maps of the first
    // Groups leave out what large polygons hide for certain, of which the sum over all maps lets some through; heaps do
    // not.
    options.error /= 20;
    const Comparison difference = compare(cuts, shade(*gpu, Method::lightcuts, of_sum));
    options.error *= 20;
    const Image sum = shade(*gpu, Method::instant_radiosity, of_sum);
    if (count < 1000) {  // (600 lights in `lamps`: 2.1 %)
      options.cut = CutWalk::heap;
      EXPECT_LT(compare(shade(*gpu, Method::lightcuts, of_heaps), sum).mean_relative_error, 0.03);
      options.cut = CutWalk::packet;
    }
    std::printf(
        "  %s, %llu lights: mean error %.2f %%, 99th percentile %.2f %%, signed %.3f %%; cut %.0f, %llu maps of "
        "%llu in %llu rounds\n",
        GetParam(), static_cast<unsigned long long>(gpu->lights().count()), 100 * difference.mean_relative_error,
        100 * difference.p99_relative_error, 100 * difference.signed_relative_error, of_cuts.cut.mean,
        static_cast<unsigned long long>(of_cuts.shadow_maps.count),
        static_cast<unsigned long long>(of_sum.shadow_maps.count),
        static_cast<unsigned long long>(of_cuts.shadow_maps.rounds));
    // A stricter cut parts its groups differently, and so what is hidden from them: in `interior` much leaks through
    // maps.
    EXPECT_LT(difference.mean_relative_error, std::string(GetParam()) == "interior" ? 0.05 : 0.02);
    EXPECT_GE(of_cuts.shadow_maps.count, of_cuts.cut.lights_used);
    EXPECT_EQ(again.shadow_maps.count, 0u);
    EXPECT_EQ(again.shadow_maps.rounds, 1u);
    EXPECT_EQ(of_cuts.rays, 0u);
    const Channel* const bound = find_channel(cuts, "cut.bound");
    ASSERT_NE(bound, nullptr);
    for (const float b : bound->values) EXPECT_LE(b, options.error);
    expect_same_planes(cuts, repeated);
    gpu->forget_maps();
    expect_same_planes(cuts, shade(*gpu, Method::lightcuts, again));
  }
}

TEST_P(CutsByMaps, AreTheCpus) {
  open(reduced() ? 300 : 3000, true);
  Statistics of_cpu, of_gpu;
  // A heap takes the CPU's decisions.
  options.cut = CutWalk::heap;
  const Image heap_a = shade(*cpu, Method::lightcuts, of_cpu), heap_b = shade(*gpu, Method::lightcuts, of_gpu);
  const double heaps = compare(heap_b, heap_a).relmse;
  std::printf("  %s, heaps: relmse %.2e, cut %.1f (CPU %.1f), %llu rounds\n", GetParam(), heaps, of_gpu.cut.mean,
              of_cpu.cut.mean, static_cast<unsigned long long>(of_gpu.shadow_maps.rounds));
  EXPECT_LT(heaps, 1e-5);
  EXPECT_NEAR(of_gpu.cut.mean / of_cpu.cut.mean, 1, 0.01);
  Statistics twice;
  expect_same_planes(heap_b, shade(*gpu, Method::lightcuts, twice));
  // Groups of pixels are not the CPU's, and what is hidden for certain from a whole group depends on the group: where
  // maps leak, both differ. So each is held against rays, to which the GPU's must be about as near.
  options.cut = CutWalk::packet;
  const Image a = shade(*cpu, Method::lightcuts, of_cpu), b = shade(*gpu, Method::lightcuts, of_gpu);
  options.visibility = Visibility::rays;
  const Image rays = shade(*cpu, Method::instant_radiosity, twice);
  const double cpu_off = compare(a, rays).rmse, gpu_off = compare(b, rays).rmse;
  std::printf("  %s: differs from rays by %.3g (CPU %.3g), relmse between both %.2e, cut %.0f (CPU %.0f)\n", GetParam(),
              gpu_off, cpu_off, compare(b, a).relmse, of_gpu.cut.mean, of_cpu.cut.mean);
  EXPECT_LT(gpu_off, 1.4 * cpu_off + 1e-4);
}

TEST_P(CutsByMaps, InLittleMemoryGiveTheSamePicture) {
  open(reduced() ? 300 : 20000, false);
  for (const CutWalk walk : {CutWalk::packet, CutWalk::heap}) {
    options.cut = walk;
    Statistics of_all, of_few;
    gpu->forget_maps();
    const Image all = shade(*gpu, Method::lightcuts, of_all);
    // The least that is accepted, and a little more.
    int accepted = 0;
    for (std::uint64_t budget = 2 << 20; accepted < (reduced() ? 2 : 4); budget += budget / 2) {
      ASSERT_LT(budget, std::uint64_t{1} << 30);
      gpu->forget_maps();
      try {
        const Image few = shade(*gpu, Method::lightcuts, of_few, budget);
        ++accepted;
        std::printf(
            "  %s, %s: %llu maps, %llu at a time at most, in %llu rounds with %.1f MiB\n", GetParam(),
            walk == CutWalk::heap ? "heap" : "packet", static_cast<unsigned long long>(of_all.shadow_maps.count),
            static_cast<unsigned long long>(of_few.shadow_maps.room),
            static_cast<unsigned long long>(of_few.shadow_maps.rounds), static_cast<double>(budget) / (1 << 20));
        // Where a group is lit by what was remembered of its lookups, in steps of 1/255, what it takes is judged
        // otherwise too: its cut may be another, of the same promise.
        const double apart = compare(few, all).relmse;
        if (apart > 0) std::printf("    relmse %.1e\n", apart);
        EXPECT_LT(apart, 2e-5);
      } catch (const Error& error) {
        ASSERT_EQ(error.code(), Code::out_of_memory);
        ASSERT_EQ(accepted, 0) << error.what();
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Scenes, CutsByMaps, testing::Values("cornell", "study", "interior", "lamps?count=100"));

TEST_F(OnDevice, MillionLightsFitWithTheirMapsIntoABudget) {
  if (reduced()) GTEST_SKIP() << "too long under a checker";
  const Scene scene = valid("study");
  const auto gpu = make_cuda_backend(0, std::uint64_t{640} << 20);
  gpu->set_scene(scene, {});
  VplOptions vpls;
  vpls.count = 1 << 20;
  gpu->trace_vpls(vpls, {});
  gpu->build_light_tree({}, {});
  ShadeOptions options;
  options.method = Method::lightcuts;
  options.visibility = Visibility::ism;
  options.ism_size = 32;
  options.ism_points = 2000;
  Statistics s;
  const Image picture = gpu->shade(select_camera(scene, ""), 500, 500, options, 0, s, {}).image;
  std::printf("  %llu lights, 500x500: %llu maps, room for %llu, %llu rounds; peak %.0f MB\n",
              static_cast<unsigned long long>(gpu->light_counts().vpls),
              static_cast<unsigned long long>(s.shadow_maps.count), static_cast<unsigned long long>(s.shadow_maps.room),
              static_cast<unsigned long long>(s.shadow_maps.rounds),
              static_cast<double>(s.memory_bytes.device_peak) / 1e6);
  EXPECT_LE(s.memory_bytes.device_peak, std::uint64_t{640} << 20);
  EXPECT_EQ(s.cut.at_limit, 0);
}

// --- The promise ---

/// What `share_of(kind, light, receiver)` needs, fetched from the device.
struct FetchedMaps {
  std::vector<std::uint32_t> slots[kKinds];
  std::vector<MapRecord> records;
  std::vector<std::uint16_t> codes;
  MapSetView view;

  FetchedMaps(const LightMaps& maps, const Lights& lights) {
    const MapSetView& d = maps.view();
    const std::size_t counts[] = {lights.vpls.size(), lights.points.size(), lights.directionals.size()};
    const std::uint32_t* const from[] = {d.vpl_slots, d.point_slots, d.directional_slots};
    check(cudaDeviceSynchronize(), "waiting");
    for (int kind = 0; kind < kKinds; ++kind) slots[kind] = fetch(from[kind], counts[kind]);
    records = fetch(d.records, maps.count());
    codes = fetch(static_cast<const std::uint16_t*>(d.codes), maps.count() * std::size_t{1} * d.size * d.size);
    view = {slots[0].data(), slots[1].data(), slots[2].data(), records.data(), codes.data(), d.size, d.depth_bits};
  }
  template <class T>
  static std::vector<T> fetch(const T* data, std::size_t count) {
    std::vector<T> values(count);
    if (count > 0) check(cudaMemcpy(values.data(), data, count * sizeof(T), cudaMemcpyDeviceToHost), "fetching");
    return values;
  }
  [[nodiscard]] double share(const Lights& lights, int kind, std::uint32_t light, Vec3 at, Vec3 ng) const {
    if (kind == vpl_kind) return vpl_share(view, light, at, ng);
    if (kind == point_kind) return point_share(view, light, lights.points[light].cos_outer, at, ng);
    return directional_share(view, light, at, ng);
  }
};

TEST_F(OnDevice, CutsByMapsKeepTheirPromiseAgainstTheShadowedTotal) {
  constexpr float kMinDistance = 0.05f, kError = 0.02f;
  // Lights and receivers among a room's boxes.
  const Scene scene = valid("cornell");
  const SceneArrays arrays(scene);
  const DeviceScene on_device(*device, scene, arrays.view());
  const DeviceEdges edges(*device, arrays.view());
  const DevicePoints points(*device, on_device.view(), edges, 2000, 1);
  const Box bounds = scene_bounds(scene);
  const auto inside = [&](Vec3 v) { return center(bounds) + v * (0.3f * diagonal(bounds) / 1.5f); };
  Lights lights = test::mixed_lights(21, reduced() ? 200 : 3000, 60, 20);
  for (Vpl& v : lights.vpls) v.position = inside(v.position);
  for (PointLight& p : lights.points) p.position = inside(p.position * 0.7f);
  const LightTrees trees = build_light_trees(lights, diagonal(bounds), {}, {});
  Receivers at(22, 40);
  for (Vec3& p : at.position) p = inside(p);

  const DeviceLights sent = send_lights(*device, lights);
  const DeviceTrees sent_trees = upload_light_trees(*device, trees, sent);
  const LightArrays arrays_of_lights{sent.vpls.data(), sent.points.data(), sent.directionals.data(),
                                     sent.vpl_count,   sent.point_count,   sent.directional_count};
  MapOptions map_options;
  map_options.size = 128;  // so large that they are made as they are asked for
  LightMaps maps(*device, points, map_options, arrays_of_lights, std::uint64_t{1} << 30);
  const auto position = send(*device, at.position), ns = send(*device, at.ns), ng = send(*device, at.ng),
             albedo = send(*device, at.albedo);
  const std::size_t n = at.position.size();
  for (const std::uint32_t heavy_work : {16384u, 1024u, 64u}) {
    const auto light = cleared<Vec3T<double>>(*device, n);
    const auto lost = cleared<double>(*device, n);
    const auto rays = cleared<std::uint32_t>(*device, n), size = cleared<std::uint32_t>(*device, n);
    const auto bound = cleared<float>(*device, n);
    const auto at_limit = cleared<std::uint8_t>(*device, n);
    constexpr std::uint32_t kMostListed = 4'000'000;
    const DeviceBuffer<ListedNode> listed(*device, kMostListed);
    auto listed_count = cleared<std::uint32_t>(*device, 1);
    const std::uint32_t all = at.tiles() * kTileGroups;
    const auto lit_by = cleared<LitBy>(*device, all);
    CutView view{size.data(), bound.data(), at_limit.data(), nullptr, {}};
    view.lit_by = lit_by.data();
    view.listing = {listed.data(), listed_count.data(), kMostListed, false};
    CutJob job{
        sent_trees.view(), arrays_of_lights, kMinDistance, kError, 0, {heavy_work, heavy_work / 4, 4 * heavy_work}};
    const PixelView pixels{position.data(), ns.data(), ng.data(), albedo.data(), nullptr, nullptr};
    const PictureGroups groups(*device, pixels, at.tiles());
    job.groups = groups.pixels();
    const SumView sums{light.data(), lost.data(), rays.data()};
    std::vector<ListedNode> nodes;
    std::uint64_t rounds = 0;
    const auto light_units = [&](const UnitList& list, const MissedList& missed) {
      // Of a group that misses a map what was listed does not count: a later round lists it again.
      listed_count.fill_bytes(0);
      cut_by_packets(*device, maps.view(), maps.wanted(), maps.table(), pixels, job, {list.units, list.count, missed},
                     sums, view);
      const std::uint32_t found = fetch(listed_count)[0];
      EXPECT_LT(found, kMostListed);
      std::vector<ListedNode> now(found);
      listed.download(now.data(), found);
      std::vector<std::uint32_t> renewed(at.tiles(), 0);
      for (const ListedNode& node : now) renewed[node.tile] |= node.lanes;
      for (ListedNode& node : nodes) node.lanes &= ~renewed[node.tile];
      std::erase_if(nodes, [&](const ListedNode& node) { return node.lanes == 0; });
      nodes.insert(nodes.end(), now.begin(), now.end());
      return true;
    };
    const auto look_up = [&](std::uint32_t unit, int kind, const std::uint32_t* ids, std::uint32_t count,
                             std::uint8_t* shares) {
      look_up_tile(*device, maps.view(), pixels, arrays_of_lights, unit / kTileGroups, kind, ids, count, shares);
    };
    ASSERT_TRUE(light_in_rounds(
        *device, maps, job.trees, {groups.list().groups, groups.list().count}, kTileGroups, {light_units, look_up},
        [](double) { return true; }, rounds));
    const std::vector<test::CutNodes> cuts = last_walks(nodes, n);
    const FetchedMaps fetched(maps, lights);
    const auto bounds_found = fetch(bound);
    const auto light_found = fetch(light);
    double shadow = 0;
    int checked = 0, apart = 0;
    const LightTree* const by_kind[] = {&trees.vpls, &trees.points, &trees.directionals};
    for (std::size_t i = 0; i < n; i += 5) {
      if (at.ns[i] == Vec3{}) continue;
      const test::CheckedPoint point{at.position[i], at.ns[i], at.ng[i], at.albedo[i], kMinDistance};
      for (int kind = 0; kind < kKinds; ++kind) {
        ASSERT_TRUE(test::holds_each_light_once(*by_kind[kind], cuts[i][kind])) << "pixel " << i;
      }
      const test::DoubleCheck check = test::check_again(lights, trees, cuts[i], point);
      double total = 0;
      for (int kind = 0; kind < kKinds; ++kind) {
        for (const std::uint32_t index : cuts[i][kind]) {
          const LightNode& node = by_kind[kind]->nodes[index];
          const double unshadowed = test::luminance_of(point.albedo, node.intensity) *
                                    test::oracle_factor(lights, kind, node.representative, point);
          if (!(unshadowed > 0)) continue;
          total += unshadowed * fetched.share(lights, kind, node.representative, point.position, point.ng);
        }
      }
      EXPECT_LE(bounds_found[i], kError);
      const Vec3T<double> l = light_found[i];
      const double found =
          test::luminance_of(point.albedo, {static_cast<float>(l.x), static_cast<float>(l.y), static_cast<float>(l.z)});
      EXPECT_LE(check.largest, static_cast<double>(kError) * found) << "pixel " << i;
      // Rounding may decide one of the five lookups of a light otherwise.
      EXPECT_NEAR(found, total, 0.01 * total + 1e-9) << "pixel " << i;
      ++checked;
      if (std::abs(found - total) > 1e-4 * total) ++apart;
      if (check.total > 0) shadow += 1 - total / check.total;
    }
    EXPECT_LE(apart, 1 + checked / 20);
    EXPECT_GT(shadow, 1) << "hardly anything lies in shadow: the test would not see a total without";
    if (!reduced() && heavy_work == 16384) {
      EXPECT_GT(rounds, 1u) << "no map was missing: the test would not see what is left then";
    }
    std::printf("  %u: %u maps, %llu rounds\n", heavy_work, maps.count(), static_cast<unsigned long long>(rounds));
  }
}

}  // namespace
}  // namespace lightcuts::cuda
