#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "ism/map_scene.h"
#include "oracle/shadow_map_agreement.h"

namespace lightcuts {
namespace {

oracle::Agreement measure(const MapScene& s, std::uint32_t points, const ShadowMapOptions& options,
                          bool edges = false) {
  constexpr std::size_t step = 12;
  const Maps maps(s, points, options, every_light(s.light_set, 0, step));
  return oracle::measure_agreement(maps.set, s.light_set, s.cpu_scene, s.tracer, step, 160, edges);
}

TEST(ShadowMapAgreement, OnStudyAndCornellIsThatOfTheSpecification) {
  for (const char* name : {"study", "cornell"}) {
    MapScene s(make_builtin_scene(name));
    s.trace(1500);
    const oracle::Agreement a = measure(s, 8000, {}, true);
    EXPECT_GE(a.agreement(), 0.93) << name;
    EXPECT_GE(a.balanced(), 0.88) << name;
    EXPECT_GT(a.agreement(), a.always_lit() + 0.1) << name;
    // Errors sit at edges: away from them a map is right 98 times of 100.
    const double wrong = a.wrongly_lit + a.wrongly_dark;
    EXPECT_GE(a.wrong_at_edges / wrong, 0.85) << name;
    EXPECT_LE((wrong - a.wrong_at_edges) / (a.pairs - a.at_edges), 0.02) << name;
  }
}

TEST(ShadowMapAgreement, MorePointsAndTexelsConvergeToRays) {
  MapScene s(make_builtin_scene("study"));
  s.trace(600);
  double last = 0;
  for (const auto& [size, points] : {std::pair{16, 1000u}, {32, 4000u}, {64, 16000u}, {256, 128000u}}) {
    ShadowMapOptions options;
    options.size = size;
    const double agreement = measure(s, points, options).agreement();
    EXPECT_GT(agreement, last) << size;
    last = agreement;
  }
  EXPECT_GE(last, 0.975);
}

TEST(ShadowMapAgreement, TheStudysNoiseAndMeanWorkToo) {
  MapScene s(make_builtin_scene("cornell"));
  s.trace(500);
  ShadowMapOptions options;
  options.choice = PointChoice::noise;
  options.fill = HoleFill::mean;
  options.depth_bits = 32;
  EXPECT_GE(measure(s, 8000, options).agreement(), 0.93);
}

TEST(ShadowMaps, DependNeitherOnThreadsNorOnWhichOthersAreMade) {
  MapScene s(make_builtin_scene("study"));
  s.trace(300);
  Maps all(s, 1000, {}, every_light(s.light_set));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  Maps some(s, 1000, {}, {{17, 200}, {}, {}});
  EXPECT_TRUE(some.set.has(LightKind::vpl, 17));
  EXPECT_FALSE(some.set.has(LightKind::vpl, 18));
  some.set.add({{5, 17}, {}, {}});
  EXPECT_EQ(some.set.map_count(), 3u);
  for (const std::uint32_t light : {5u, 17u, 200u}) {
    EXPECT_EQ(all.set.codes_of(LightKind::vpl, light), some.set.codes_of(LightKind::vpl, light));
  }
  EXPECT_EQ(some.share(LightKind::vpl, 18, {0, 1, 0}, {0, 1, 0}), 1) << "a light without a map is seen";
}

}  // namespace
}  // namespace lightcuts
