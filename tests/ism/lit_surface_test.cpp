#include <gtest/gtest.h>

#include "ism/map_scene.h"
#include "oracle/contact_shadows.h"
#include "oracle/lit_surfaces.h"
#include "oracle/tally.h"

namespace lightcuts {
namespace {

class LitSurfaceTest : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, LitSurfaceTest, testing::Values("study", "cornell", "furnace", "interior"));

TEST_P(LitSurfaceTest, IsFreeOfAcneAtAllMapSizes) {
  MapScene s(make_builtin_scene(GetParam()));
  s.trace(600);
  constexpr std::size_t step = 25;
  for (const int size : {16, 32, 64, 128, 256}) {
    ShadowMapOptions options;
    options.size = size;
    const Maps maps(s, 8000, options, every_light(s.light_set, 0, step));
    const oracle::LitSurfaces found =
        oracle::measure_lit_surfaces(maps.set, s.light_set, s.cpu_scene, s.tracer, step, 60);
    // Of an interior's slender things the discs of 8000 points stand out by a little.
    EXPECT_GE(found.clear.lit_share(), 0.994) << size << " texels";
    EXPECT_GE(found.clear.exact_share(), 0.9975) << size << " texels";
    // In corners a lookup falls on the next surface, with exact depths too.
    EXPECT_GE(found.corners.lit_share(), found.corners.exact_share() - 0.03) << size << " texels";
    EXPECT_GE(found.corners.exact_share(), 0.91) << size << " texels";
    EXPECT_GT(found.clear.asked + found.corners.asked, 500);
  }
}

TEST(ContactShadows, AreNotLostNorDoTheyDarkenWhatIsLit) {
  MapScene s(oracle::box_on_floor());
  s.trace(2000);
  constexpr std::size_t step = 20;
  struct Limit {
    int size;
    double leaked, kept;
  };
  for (const Limit limit : {Limit{32, 0.36, 0.76}, {64, 0.21, 0.78}, {128, 0.12, 0.78}}) {
    ShadowMapOptions options;
    options.size = limit.size;
    const Maps maps(s, 8000, options, every_light(s.light_set, 0, step));
    for (const float off : {0.01f, 0.02f, 0.05f}) {
      oracle::Tally floor, box;
      const auto ask = [&](oracle::ContactSide side, oracle::Tally& tally) {
        oracle::for_each_contact(s.light_set, s.tracer, step, off, side,
                                 [&](std::uint32_t light, Vec3 at, Vec3 normal, bool visible) {
                                   tally.add(visible, maps.share(LightKind::vpl, light, at, normal));
                                 });
      };
      ask(oracle::ContactSide::floor, floor);
      ask(oracle::ContactSide::box, box);
      ASSERT_GT(floor.lit, 300);
      ASSERT_GT(floor.dark, 300);
      EXPECT_LE(floor.leaked(), limit.leaked) << limit.size << " texels, " << off << " m";
      EXPECT_GE(floor.kept(), limit.kept) << limit.size << " texels, " << off << " m";
      EXPECT_GE(box.kept(), 0.85) << limit.size << " texels, " << off << " m";
    }
  }
}

}  // namespace
}  // namespace lightcuts
