#include <gtest/gtest.h>

#include "ism/map_scene.h"
#include "oracle/lit_surfaces.h"

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
        oracle::measure_lit_surfaces(maps.set, s.light_set, s.cpu_scene, s.tracer, step, 60, true);
    EXPECT_GT(found.asked, 200);
    // Lookups lose a little even with exact depths, of what is curved or close to other things.
    EXPECT_GE(found.lit_share(), std::min(0.99, found.exact_share() - 0.02)) << size << " texels";
  }
}

}  // namespace
}  // namespace lightcuts
