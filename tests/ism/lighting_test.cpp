#include <gtest/gtest.h>

#include "cpu/film.h"
#include "cpu/ism/map_plan.h"
#include "cpu/ism/shadow_map_pool.h"
#include "cpu_shade/lit_backend.h"
#include "cpu_shade/rooms.h"
#include "ism/map_scene.h"
#include "lightcuts/compare.h"
#include "lightcuts/error.h"
#include "lightcuts/renderer.h"

namespace lightcuts {
namespace {

ShadeOptions by_maps() {
  ShadeOptions options;
  options.visibility = Visibility::ism;
  options.ism_points = 2000;
  options.ism_size = 32;
  return options;
}

struct Rendered {
  Image image;
  Statistics statistics;
};

Rendered shade(int threads, const ShadeOptions& options, std::uint64_t memory = 0, std::uint64_t vpls = 600) {
  Scene scene = lit_room();
  PointLight point;
  point.position = {0.3f, 0.2f, 0.5f};
  point.intensity = {0.2f, 0.2f, 0.2f};
  scene.point_lights.push_back(point);
  LitBackend lit(std::move(scene), vpls, threads);
  Image image = lit.shade(room_camera(), 40, 24, options, memory);
  return {std::move(image), lit.statistics};
}

void expect_same(const Image& a, const Image& b, float relative) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    for (std::size_t i = 0; i < a.channels[c].values.size(); ++i) {
      const float x = a.channels[c].values[i], y = b.channels[c].values[i];
      if (x != y) {
        ASSERT_NEAR(x, y, relative * std::abs(y)) << a.channels[c].name << " " << i;
      }
    }
  }
}

TEST(LightByMaps, ConvergesToRaysWithPointsAndTexels) {
  const Image reference = shade(2, {}, 0, 300).image;
  double last = 0.02;
  for (const auto& [size, points] : {std::pair{32, 2000}, {64, 8000}, {128, 32000}, {256, 64000}}) {
    ShadeOptions options = by_maps();
    options.ism_size = size;
    options.ism_points = points;
    const double error = compare(shade(2, options, 0, 300).image, reference).relmse;
    EXPECT_LT(error, 0.75 * last) << size;
    last = error;
  }
  EXPECT_LT(last, 3e-4);
}

TEST(LightByMaps, ThreadsDoNotChangeThePicture) {
  ShadeOptions options = by_maps();
  options.samples = 2;
  expect_same(shade(1, options).image, shade(2, options).image, 0);
}

TEST(LightByMaps, BatchesChangeOnlyRounding) {
  const Rendered whole = shade(2, by_maps());
  const PointOptions points{2000};
  const std::uint64_t film = 40 * 24 * Film::bytes_per_pixel();
  const Rendered parts = shade(2, by_maps(), film + SurfacePoints::bytes_for(points) + 8 * 700 + 100 * 2048);
  EXPECT_EQ(whole.statistics.shadow_maps.count, parts.statistics.shadow_maps.count);
  EXPECT_EQ(whole.statistics.shadow_maps.size, 32);
  EXPECT_LT(parts.statistics.shadow_maps.bytes, 110 * 2048u);
  EXPECT_GT(whole.statistics.shadow_maps.bytes, 550 * 2048u);
  EXPECT_EQ(whole.statistics.pairs, parts.statistics.pairs);
  EXPECT_EQ(whole.statistics.rays, 0u);
  expect_same(parts.image, whole.image, 1e-5f);
}

TEST(LightcutsByMaps, KeepTheirPromiseAgainstTheSumOverAllMapsAndMakeOnlyWhatTheyUse) {
  const Rendered sum = shade(2, by_maps(), 0, 3000);
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    ShadeOptions options = by_maps();
    options.method = Method::lightcuts;
    options.cut = walk;
    const Rendered cut = shade(2, options, 0, 3000);
    EXPECT_LT(compare(cut.image, sum.image).mean_relative_error, 0.02);
    EXPECT_EQ(cut.statistics.rays, 0u);
    EXPECT_GT(cut.statistics.shadow_maps.count, 100u);
    EXPECT_LE(cut.statistics.shadow_maps.count, sum.statistics.shadow_maps.count);
    EXPECT_EQ(cut.statistics.shadow_maps.bytes, cut.statistics.shadow_maps.count * 2048);
    expect_same(shade(1, options, 0, 3000).image, cut.image, 0);
  }
}

/// A budget with room for `maps` maps beside everything else.
std::uint64_t budget_for(std::uint64_t maps, std::uint64_t lights) {
  const ShadowMapOptions options{32};
  return 40 * 24 * Film::bytes_per_pixel() + SurfacePoints::bytes_for({300}) + ShadowMapPool::kBytesPerLight * lights +
         ShadowMapPool::bytes_per_map(options) * maps;
}

TEST(LightcutsByMaps, ASmallBudgetMakesThemSlowerAndNothingElse) {
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    ShadeOptions options = by_maps();
    options.method = Method::lightcuts;
    options.cut = walk;
    options.ism_points = 300;
    const Rendered ample = shade(2, options, 0, 700);
    EXPECT_EQ(ample.statistics.shadow_maps.rounds, 1u);
    EXPECT_GT(ample.statistics.time_ms.shadow_maps, 0);
    // Room for most of what is in use, for a part, and for less than one tile asks for.
    for (const std::uint64_t room :
         {ample.statistics.shadow_maps.count * 3 / 4, std::uint64_t{200}, std::uint64_t{8}}) {
      const Rendered tight = shade(2, options, budget_for(room + 1, 800), 700);
      expect_same(tight.image, ample.image, 0);
      EXPECT_EQ(tight.statistics.pairs, ample.statistics.pairs) << room;
      EXPECT_GT(tight.statistics.shadow_maps.rounds, 1u) << room;
      EXPECT_LE(tight.statistics.shadow_maps.room, room + 1);
      EXPECT_LE(tight.statistics.shadow_maps.bytes, (room + 1) * 2048);
      EXPECT_GT(tight.statistics.shadow_maps.count, ample.statistics.shadow_maps.count) << "some are made again";
    }
  }
}

TEST(LightcutsByMaps, AreKeptForTheNextPictureAsFarAsTheBudgetGoes) {
  const Scene scene = lit_room();
  RenderOptions options;
  options.backend = BackendKind::cpu;
  options.width = 40;
  options.height = 24;
  options.threads = 2;
  options.vpls.count = 700;
  options.shade = by_maps();
  options.shade.ism_points = 300;
  options.shade.method = Method::lightcuts;
  options.shade.error = 0.1f;
  const auto tight = [](std::uint64_t maps) { return budget_for(maps, 800); };
  for (const std::uint64_t memory : {std::uint64_t{0}, tight(300), tight(60)}) {
    options.memory_bytes = memory;
    Renderer renderer(scene, options);
    std::uint64_t made[3] = {};
    for (int i = 0; i < 3; ++i) {
      Camera camera = room_camera();
      if (i == 1) camera.world_from_camera.origin.x += 0.05f;
      const std::uint64_t before = renderer.runs().shadow_maps;
      const Image picture = renderer.render(camera).image;
      made[i] = renderer.runs().shadow_maps - before;
      expect_same(picture, render(scene, camera, options).image, 0);
    }
    EXPECT_EQ(renderer.runs().surface_points, 1u);
    if (memory == 0) {
      EXPECT_LT(made[1], made[0] / 4);
      EXPECT_EQ(made[2], 0u);
    }
  }
}

TEST(ShadowMapPool, ForgetsSomeMapsAndTakesAnotherRoom) {
  MapScene s(lit_room());
  s.trace(500);
  const SurfacePoints points(s.cpu_scene.view(), {300});
  const ShadowMapOptions options{16};
  const MapMaker maker(ism_kernels(selected_isa()), points, s.light_set, options);
  const std::size_t all = MapMaker::maps_of(s.light_set);
  ShadowMapPool pool(maker, all, 1);
  ReceiverPacket receivers{};
  receivers.position.y[0] = 0.5f;
  receivers.ng.y[0] = 1;
  const RayPacket16 rays{};
  const auto share_of = [&](std::uint32_t light) {
    alignas(64) float share[kPacketSize];
    pool.shares({LightKind::vpl, light, receivers, rays, 1}, share);
    return share[0];
  };
  std::vector<float> first;
  for (std::uint32_t light = 0; light < 100; ++light) first.push_back(share_of(light));
  EXPECT_EQ(pool.made(), 100u);
  pool.begin_picture();
  pool.forget({{3, 4, 400}, {}, {}});
  EXPECT_TRUE(pool.has_room_for_all()) << "the places of two are free";
  for (std::uint32_t light = 0; light < 100; ++light) EXPECT_EQ(share_of(light), first[light]);
  EXPECT_EQ(pool.made(), 2u);
  EXPECT_EQ(pool.most(), 100u);
  EXPECT_TRUE(pool.change_room(all + 64));
  EXPECT_FALSE(pool.change_room(64)) << "there are more";
  EXPECT_GE(pool.bytes(), 100 * MapBlocks::stride(options));
  EXPECT_LE(pool.bytes(), 192 * MapBlocks::stride(options));
}

TEST(LightcutsByMaps, WithoutErrorAreTheSumOverAllMapsButForWhatIsHidden) {
  // A promise of zero means every light by itself: then the heap's is the sum, to rounding. The packet walk leaves out
  // what large polygons hide for certain, of which maps let some light through.
  const Rendered sum = shade(2, by_maps(), 0, 300);
  ShadeOptions options = by_maps();
  options.method = Method::lightcuts;
  options.error = 1e-6f;
  options.cut = CutWalk::heap;
  EXPECT_LT(compare(shade(2, options, 0, 300).image, sum.image).mean_relative_error, 2e-5);
  options.cut = CutWalk::packet;
  const Rendered packet = shade(2, options, 0, 300);
  EXPECT_LT(compare(packet.image, sum.image).mean_relative_error, 0.015);
  ShadeOptions by_rays;
  by_rays.visibility = Visibility::rays;
  const Rendered rays = shade(2, by_rays, 0, 300);
  // In this open room hardly anything leaks, and leaks make up for dark corners: by what share depends on few lights.
  EXPECT_LT(compare(packet.image, rays.image).relmse, 1.4 * compare(sum.image, rays.image).relmse);
}

TEST(LightByMaps, SaysWhatItNeedsBeforeItTakesMemory) {
  try {
    shade(1, by_maps(), 2'000'000);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::out_of_memory);
    EXPECT_NE(std::string(error.what()).find("fewer points"), std::string::npos) << error.what();
  }
}

TEST(MapPlan, CutsNeedRoomForTwoMapsAThreadAndNoMore) {
  const std::vector<Vpl> vpls(1'000'000);
  LightSet lights;
  lights.vpls = vpls;
  const ShadowMapOptions options;
  const std::uint64_t fixed = SurfacePoints::bytes_for({8000}) + ShadowMapPool::kBytesPerLight * 1'000'000;
  const std::uint64_t per_map = ShadowMapPool::bytes_per_map(options);
  EXPECT_EQ(plan_pool(lights, {8000}, options, 16, 0), 1'000'000u);
  EXPECT_EQ(plan_pool(lights, {8000}, options, 16, fixed + 32 * per_map), 32u);
  EXPECT_THROW(plan_pool(lights, {8000}, options, 16, fixed + 31 * per_map), Error);
  const std::uint64_t room = plan_pool(lights, {8000}, options, 16, std::uint64_t{4} << 30);
  EXPECT_GT(room, 400'000u);
  EXPECT_LE(fixed + room * per_map, std::uint64_t{4} << 30);
}

TEST(MapPlan, AMillionMapsFitIntoAFewGibibytes) {
  const std::vector<Vpl> vpls(1'000'000);
  LightSet lights;
  lights.vpls = vpls;
  ShadowMapOptions options;
  options.size = 128;
  const std::uint64_t budget = std::uint64_t{3} << 30;
  const MapPlan plan = plan_maps(lights, {8000}, options, budget);
  EXPECT_EQ(plan.maps, 1'000'000u);
  const std::uint64_t largest = (plan.maps + plan.batches - 1) / plan.batches * MapBlocks::stride(options);
  EXPECT_LE(largest + SurfacePoints::bytes_for({8000}) + 8 * plan.maps, budget);
  EXPECT_THROW(plan_maps(lights, {8000}, options, 1'000'000), Error);
}

TEST(LightByMaps, StopsAndKeepsWhatWasDone) {
  LitBackend lit(lit_room(), 3000, 1);
  int calls = 0;
  const ProgressFn stop = [&](const char*, double) { return ++calls < 2; };
  const ShadeResult result = lit.backend.shade(room_camera(), 64, 64, by_maps(), 0, lit.statistics, stop);
  EXPECT_FALSE(result.complete);
  ASSERT_NE(find_channel(result.image, "weight"), nullptr);
}

}  // namespace
}  // namespace lightcuts
