#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "cpu/all_lights.h"
#include "cpu/progress.h"
#include "cpu/ray_tracer.h"
#include "cpu/simd/isa.h"
#include "cpu_shade/random_packet.h"
#include "cpu_shade/rooms.h"
#include "oracle/light_oracle.h"

namespace lightcuts {
namespace {

class AllLightsTest : public testing::TestWithParam<Isa> {
 protected:
  const ShadeKernels& kernels = shade_kernels(GetParam());
  ProgressFn silent;
  Progress progress{silent, "shade", 1};
};
INSTANTIATE_TEST_SUITE_P(Isa, AllLightsTest, testing::ValuesIn(available_isas()),
                         [](const testing::TestParamInfo<Isa>& parameter) {
                           std::string name(isa_name(parameter.param));
                           std::erase(name, '.');
                           return name;
                         });

TEST_P(AllLightsTest, AMillionLightsLoseNothingInSinglePrecision) {
  Dice dice(1);
  Lights lights;
  for (int i = 0; i < 200'000; ++i) lights.vpls.push_back({dice.in_box(1), dice.direction(), dice.color()});
  // The same again and again: a million evaluations for the price of 200 000 in the oracle.
  const std::vector<Vpl> once = lights.vpls;
  for (int i = 0; i < 4; ++i) lights.vpls.insert(lights.vpls.end(), once.begin(), once.end());
  const LightSet set = make_light_set(lights);
  Tile tile{};
  tile.packets[0].receivers = random_receivers(dice, false);
  tile.packets[0].receivers.active = 1;

  TileLight lit;
  ASSERT_TRUE(AllLights(kernels, set, nullptr, 0.05f).light(tile, progress, lit));
  EXPECT_EQ(lit.pairs, 1'000'000);
  EXPECT_EQ(lit.rays, 0);
  double expected = 0;
  const ReceiverPacket& r = tile.packets[0].receivers;
  for (const Vpl& vpl : once) {
    expected += 5 * vpl.intensity.x *
                oracle::vpl_factor(get_lane(r.position, 0), get_lane(r.ns, 0), get_lane(r.ng, 0), vpl.position,
                                   vpl.axis, 0.05f);
  }
  EXPECT_NEAR(lit.light[0].x / expected, 1, 1e-6);
}

/// Lights of every kind in the lit room, some inside its walls or behind them.
Lights mixed_lights() {
  Dice dice(2);
  Lights lights;
  for (int i = 0; i < 300; ++i) lights.vpls.push_back({dice.in_box(0.99f), dice.direction(), dice.color()});
  for (int i = 0; i < 20; ++i) lights.points.push_back({dice.in_box(1.1f), dice.color()});
  for (int i = 0; i < 5; ++i) lights.directionals.push_back({dice.direction(), dice.color()});
  return lights;
}

TEST_P(AllLightsTest, ShadowRaysGiveTheSumOfWhatIsSeen) {
  // The room without its ceiling, so that directional lights come in.
  Scene scene = lit_room();
  scene.instances.erase(scene.instances.begin() + 1);
  ASSERT_TRUE(validate(scene).empty());
  const SceneArrays cpu_scene(scene);
  const RayTracer tracer(cpu_scene.view());
  const EmitterTable emitters(cpu_scene);
  const View view = make_view(room_camera(), 16, 8, 1, 1, true);
  const Tile tile = trace_tile(view, 8, 0, 0, cpu_scene.view(), tracer, emitters.view());
  const Lights lights = mixed_lights();
  const LightSet set = make_light_set(lights);
  const RayVisibility visibility(tracer);
  constexpr float min_distance = 0.1f;

  TileLight lit;
  ASSERT_TRUE(AllLights(kernels, set, &visibility, min_distance).light(tile, progress, lit));

  double blocked = 0, open = 0;
  for (int p = 0; p < kTilePackets; ++p) {
    const ReceiverPacket& r = tile.packets[static_cast<std::size_t>(p)].receivers;
    for (int lane = 0; lane < kPacketSize; ++lane) {
      if ((r.active >> lane & 1u) == 0) continue;
      const Vec3 at = get_lane(r.position, lane), ns = get_lane(r.ns, lane), ng = get_lane(r.ng, lane);
      double expected = 0, lost = 0;
      const auto add = [&](double factor, Vec3 intensity, Vec3 to, float t_max, double unclamped) {
        if (factor == 0) return;
        const bool hidden = tracer.occluded({at, 0, to, t_max});
        (hidden ? blocked : open) += 1;
        if (hidden) return;
        expected += factor * intensity.y;
        lost += (unclamped - factor) * luminance(intensity);
      };
      for (const Vpl& vpl : lights.vpls) {
        const Vec3 end = offset_point(vpl.position, vpl.axis);
        add(oracle::vpl_factor(at, ns, ng, vpl.position, vpl.axis, min_distance), vpl.intensity, end - at, 1,
            oracle::vpl_factor(at, ns, ng, vpl.position, vpl.axis, 0));
      }
      for (const PointLight& light : lights.points) {
        const double factor = oracle::point_factor(at, ns, ng, light);
        add(factor, light.intensity, light.position - at, 1, factor);
      }
      for (const DirectionalLight& light : lights.directionals) {
        const double factor = oracle::directional_factor(ns, ng, light.direction);
        add(factor, light.irradiance, -light.direction, std::numeric_limits<float>::infinity(), factor);
      }
      const int pixel = p * kPacketSize + lane;
      EXPECT_NEAR(lit.light[pixel].y, expected, 1e-5 * expected) << "packet " << p << ", lane " << lane;
      EXPECT_NEAR(lit.lost[pixel], lost, 1e-4 * std::max(lost, 1.0));
    }
  }
  EXPECT_GT(blocked, 100);
  EXPECT_GT(open, 100);
  EXPECT_EQ(lit.rays, static_cast<std::uint64_t>(blocked + open));
}

TEST_P(AllLightsTest, WithoutVisibilityTheClampsLossIsThatOfTheOracle) {
  Dice dice(4);
  Lights lights;
  for (int i = 0; i < 1000; ++i) lights.vpls.push_back({dice.in_box(1), dice.direction(), dice.color()});
  const LightSet set = make_light_set(lights);
  Tile tile{};
  tile.packets[2].receivers = random_receivers(dice, true);
  TileLight lit;
  ASSERT_TRUE(AllLights(kernels, set, nullptr, 0.2f).light(tile, progress, lit));
  const ReceiverPacket& r = tile.packets[2].receivers;
  double lost = 0;
  for (const Vpl& vpl : lights.vpls) {
    const auto factor = [&](double clamp) {
      return oracle::vpl_factor(get_lane(r.position, 3), get_lane(r.ns, 3), get_lane(r.ng, 3), vpl.position, vpl.axis,
                                clamp);
    };
    lost += (factor(0) - factor(0.2)) * luminance(vpl.intensity);
  }
  EXPECT_GT(lost, 0);
  EXPECT_NEAR(lit.lost[2 * kPacketSize + 3], lost, 1e-4 * lost);
}

TEST_P(AllLightsTest, StopsWhenProgressSaysSo) {
  Dice dice(5);
  Lights lights;
  for (int i = 0; i < 1000; ++i) lights.vpls.push_back({dice.in_box(1), dice.direction(), dice.color()});
  const LightSet set = make_light_set(lights);
  Tile tile{};
  tile.packets[0].receivers = random_receivers(dice, true);
  const ProgressFn stop = [](const char*, double) { return false; };
  Progress stopping(stop, "shade", 1);
  TileLight lit;
  EXPECT_FALSE(AllLights(kernels, set, nullptr, 0).light(tile, stopping, lit));
  EXPECT_LT(lit.pairs, 16'000u);
}

}  // namespace
}  // namespace lightcuts
