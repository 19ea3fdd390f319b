#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "cpu/light_set.h"
#include "cpu/simd/isa.h"
#include "cpu/simd/shade_kernels.h"
#include "cpu_shade/random_packet.h"
#include "kernels/offset_point.h"
#include "lightcuts/error.h"
#include "oracle/light_oracle.h"

namespace lightcuts {
namespace {

/// Of one evaluation, beside what single precision makes of the difference of two positions.
constexpr double kTolerance = 1e-6;

class Kernels : public testing::TestWithParam<Isa> {
 protected:
  const ShadeKernels& kernels = shade_kernels(GetParam());
};

std::string isa_test_name(const testing::TestParamInfo<Isa>& info) {
  std::string name(isa_name(info.param));
  std::erase(name, '.');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Isa, Kernels, testing::ValuesIn(available_isas()), isa_test_name);

/// Error of `value` in units of what rounding of cosines near zero allows: cosines are absolute to 1e-7.
double relative_error(double value, double expected, double scale) {
  return std::abs(value - expected) / std::max(std::abs(expected), 0.1 * scale);
}

TEST_P(Kernels, EachVplAgreesWithDoublePrecision) {
  Dice dice(1);
  double worst = 0;
  for (int round = 0; round < 500; ++round) {
    const bool flat = round % 2 == 0;
    const ReceiverPacket receivers = random_receivers(dice, flat);
    const Vpl vpl = random_vpl(dice);
    const float min_distance = round % 3 == 0 ? 0.0f : 0.5f;
    PacketSum sum{};
    kernels.sum_vpls(receivers, &vpl, 1, min_distance * min_distance, sum);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      const Vec3 position = get_lane(receivers.position, lane);
      const double expected = oracle::vpl_factor(position, get_lane(receivers.ns, lane), get_lane(receivers.ng, lane),
                                                 vpl.position, vpl.axis, min_distance);
      const double falloff = 1 / std::max<double>(length_sq(position - vpl.position), min_distance * min_distance);
      worst = std::max(worst, relative_error(sum.light.y[lane], expected * vpl.intensity.y, falloff * vpl.intensity.y));
    }
  }
  EXPECT_LT(worst, kTolerance);
}

TEST_P(Kernels, FlatPacketsGetTheSameAsOthers) {
  Dice dice(2);
  std::vector<Vpl> vpls;
  for (int i = 0; i < 100; ++i) vpls.push_back(random_vpl(dice));
  ReceiverPacket receivers = random_receivers(dice, true);
  PacketSum fast{}, general{};
  kernels.sum_vpls(receivers, vpls.data(), vpls.size(), 0.01f, fast);
  receivers.flat = false;
  kernels.sum_vpls(receivers, vpls.data(), vpls.size(), 0.01f, general);
  for (int lane = 0; lane < kPacketSize; ++lane) {
    EXPECT_NEAR(fast.light.x[lane], general.light.x[lane], 1e-6f * general.light.x[lane]);
  }
}

TEST_P(Kernels, RaysCarryTheFactorsOfTheSumAndEndAtTheLight) {
  Dice dice(3);
  for (int round = 0; round < 100; ++round) {
    const ReceiverPacket receivers = random_receivers(dice, false);
    const Vpl vpl = random_vpl(dice);
    PacketSum sum{};
    PacketFactors factors{};
    RayPacket16 rays{};
    kernels.sum_vpls(receivers, &vpl, 1, 0.25f, sum);
    const std::uint32_t lit = kernels.vpl_shadow_rays(receivers, vpl, 0.25f, factors, rays);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      EXPECT_EQ((lit >> lane & 1u) != 0, factors.clamped[lane] > 0);
      EXPECT_NEAR(factors.clamped[lane] * vpl.intensity.x, sum.light.x[lane], 1e-6f * sum.light.x[lane]);
      EXPECT_NEAR(rays.oy[lane] + rays.t_max[lane] * rays.dy[lane], offset_point(vpl.position, vpl.axis).y, 1e-6f);
      EXPECT_EQ(rays.ox[lane], receivers.position.x[lane]);
      EXPECT_EQ(rays.t_min[lane], 0);
    }
  }
}

TEST_P(Kernels, PointAndSpotLightsAgreeWithDoublePrecision) {
  Dice dice(4);
  double worst = 0;
  for (int round = 0; round < 500; ++round) {
    const ReceiverPacket receivers = random_receivers(dice, false);
    PointLight light{dice.in_box(1), dice.color(), dice.direction()};
    if (round % 2 == 1) {
      light.cos_outer = dice.between(-0.9f, 0.5f);
      light.cos_inner = light.cos_outer + dice.between(0.1f, 0.4f);
    }
    Lights lights;
    lights.points.push_back(light);
    const LightSet set = make_light_set(lights);
    PacketSum sum{};
    kernels.sum_points(receivers, set.points.data(), 1, sum);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      const Vec3 position = get_lane(receivers.position, lane);
      const double expected = light.intensity.z * oracle::point_factor(position, get_lane(receivers.ns, lane),
                                                                       get_lane(receivers.ng, lane), light);
      const double falloff = light.intensity.z / static_cast<double>(length_sq(position - light.position));
      // A spot's edge magnifies the rounding of its cosine by up to 2 / 0.1.
      worst = std::max(worst, relative_error(sum.light.z[lane], expected, falloff) / (round % 2 == 1 ? 20 : 1));
    }
  }
  EXPECT_LT(worst, kTolerance);
}

TEST_P(Kernels, DirectionalLightsAgreeWithDoublePrecision) {
  Dice dice(5);
  for (int round = 0; round < 100; ++round) {
    const ReceiverPacket receivers = random_receivers(dice, false);
    const DirectionalRecord light{dice.direction(), dice.color()};
    PacketSum sum{};
    kernels.sum_directionals(receivers, &light, 1, sum);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      const double expected =
          light.irradiance.x *
          oracle::directional_factor(get_lane(receivers.ns, lane), get_lane(receivers.ng, lane), light.direction);
      EXPECT_NEAR(sum.light.x[lane], expected, 3e-7);
    }
  }
}

TEST_P(Kernels, TheClampsLossIsWhatItTakes) {
  Dice dice(6);
  const ReceiverPacket receivers = random_receivers(dice, false);
  std::vector<Vpl> vpls;
  for (int i = 0; i < 200; ++i) vpls.push_back(random_vpl(dice));
  PacketSum clamped{}, unclamped{}, loss{};
  EXPECT_TRUE(kernels.sum_vpls(receivers, vpls.data(), vpls.size(), 0.25f, clamped));
  EXPECT_FALSE(kernels.sum_vpls(receivers, vpls.data(), vpls.size(), 0, unclamped));
  kernels.sum_vpl_loss(receivers, vpls.data(), vpls.size(), 0.25f, loss);
  float total = 0;
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const float all = luminance(get_lane(unclamped.light, lane));
    EXPECT_NEAR(loss.lost[lane], all - luminance(get_lane(clamped.light, lane)), 1e-5f * all);
    total += loss.lost[lane];
  }
  EXPECT_GT(total, 0);
}

TEST_P(Kernels, AccumulateAddsWhatArrives) {
  PacketFactors factors{};
  alignas(64) float share[kPacketSize] = {1, 0.5f, 0, 1};
  for (int lane = 0; lane < kPacketSize; ++lane) {
    factors.clamped[lane] = static_cast<float>(lane + 1);
    factors.unclamped[lane] = static_cast<float>(lane + 2);
  }
  PacketSum sum{};
  kernels.accumulate(factors, {1, 2, 3}, share, sum);
  kernels.accumulate(factors, {1, 2, 3}, share, sum);
  EXPECT_FLOAT_EQ(sum.light.x[0], 2);
  EXPECT_FLOAT_EQ(sum.light.y[1], 4);
  EXPECT_FLOAT_EQ(sum.light.z[2], 0);
  EXPECT_FLOAT_EQ(sum.light.z[3], 24);
  EXPECT_FLOAT_EQ(sum.lost[1], luminance(Vec3{1, 2, 3}));
}

// --- Degenerate lights: nothing that is finite goes in may come out as NaN or infinity ---

TEST_P(Kernels, LightsAtTheReceiverOrBehindItGiveNothing) {
  Dice dice(7);
  ReceiverPacket receivers = random_receivers(dice, false);
  for (int lane = 0; lane < kPacketSize; ++lane) {
    set_lane(receivers.position, lane, {1, 2, 3});
    set_lane(receivers.ns, lane, {0, 0, 1});
    set_lane(receivers.ng, lane, {0, 0, 1});
  }
  const Vpl vpls[] = {{{1, 2, 3}, {0, 0, -1}, {1, 1, 1}},   // at the receiver
                      {{1, 2, 2}, {0, 0, 1}, {1, 1, 1}},    // behind the receiver
                      {{1, 2, 4}, {0, 0, 1}, {1, 1, 1}},    // in front, but turned away
                      {{1, 2, 4}, {0, 0, -1}, {0, 0, 0}}};  // black
  for (const Vpl& vpl : vpls) {
    for (const float clamp_sq : {0.0f, 1.0f}) {
      PacketSum sum{};
      kernels.sum_vpls(receivers, &vpl, 1, clamp_sq, sum);
      EXPECT_EQ(sum.light.x[5], 0);
      kernels.sum_vpl_loss(receivers, &vpl, 1, clamp_sq, sum);
      EXPECT_EQ(sum.lost[5], 0);
    }
  }
}

TEST_P(Kernels, ShadingNormalsDoNotLetLightThroughASurface) {
  Dice dice(8);
  ReceiverPacket receivers = random_receivers(dice, false);
  set_lane(receivers.position, 0, {0, 0, 0});
  set_lane(receivers.ng, 0, {0, 0, 1});
  set_lane(receivers.ns, 0, normalize(Vec3{1, 0, 1}));
  const Vpl below{{1, 0, -0.5f}, normalize(Vec3{-1, 0, 0.5f}), {1, 1, 1}};
  const Vpl above{{1, 0, 0.5f}, normalize(Vec3{-1, 0, -0.5f}), {1, 1, 1}};
  PacketSum sum{};
  kernels.sum_vpls(receivers, &below, 1, 0, sum);
  EXPECT_EQ(sum.light.x[0], 0);
  kernels.sum_vpls(receivers, &above, 1, 0, sum);
  EXPECT_GT(sum.light.x[0], 0.5f);
}

TEST_P(Kernels, ExtremeDistancesStayFinite) {
  Dice dice(9);
  for (const float size : {1e-30f, 1e-12f, 1e-6f, 1e6f, 1e9f}) {
    const ReceiverPacket receivers = random_receivers(dice, false, size);
    std::vector<Vpl> vpls;
    for (int i = 0; i < 50; ++i) vpls.push_back(random_vpl(dice, size));
    PacketSum sum{};
    kernels.sum_vpls(receivers, vpls.data(), vpls.size(), 0, sum);
    kernels.sum_vpl_loss(receivers, vpls.data(), vpls.size(), size, sum);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      EXPECT_TRUE(is_finite(get_lane(sum.light, lane))) << size;
      EXPECT_TRUE(std::isfinite(sum.lost[lane])) << size;
    }
  }
}

TEST_P(Kernels, PointLightsAtTheReceiverStayFinite) {
  Dice dice(10);
  ReceiverPacket receivers = random_receivers(dice, false);
  Lights lights;
  lights.points.push_back({get_lane(receivers.position, 0), {1, 1, 1}});
  lights.points.push_back({get_lane(receivers.position, 1), {1, 1, 1}, {0, 0, 1}, 0.5f, 0.5f});
  const LightSet set = make_light_set(lights);
  PacketSum sum{};
  kernels.sum_points(receivers, set.points.data(), set.points.size(), sum);
  for (int lane = 0; lane < kPacketSize; ++lane) EXPECT_TRUE(is_finite(get_lane(sum.light, lane)));
}

TEST(LightSet, RefusesLightsThatCannotBeSummed) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const auto refused = [](const Vpl& vpl) {
    Lights lights;
    lights.vpls.push_back(vpl);
    EXPECT_THROW(make_light_set(lights), Error);
  };
  refused({{nan, 0, 0}, {0, 0, 1}, {1, 1, 1}});
  refused({{2e9f, 0, 0}, {0, 0, 1}, {1, 1, 1}});
  refused({{0, 0, 0}, {0, nan, 1}, {1, 1, 1}});
  refused({{0, 0, 0}, {0, 0, 1}, {infinite, 1, 1}});
  refused({{0, 0, 0}, {0, 0, 1}, {-1, 1, 1}});
}

TEST(Isa, TheEnvironmentChoosesAndMistakesAreNamed) {
  const char* before = std::getenv("LIGHTCUTS_ISA");
  const std::string kept = before == nullptr ? "" : before;
  setenv("LIGHTCUTS_ISA", "baseline", 1);
  EXPECT_EQ(selected_isa(), Isa::baseline);
  setenv("LIGHTCUTS_ISA", "avx1024", 1);
  try {
    (void)selected_isa();
    ADD_FAILURE() << "an unknown instruction set was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::invalid_argument);
    EXPECT_NE(std::string(error.what()).find("avx1024"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("baseline"), std::string::npos);
  }
  unsetenv("LIGHTCUTS_ISA");
  EXPECT_EQ(selected_isa(), available_isas().back());
  if (before != nullptr) setenv("LIGHTCUTS_ISA", kept.c_str(), 1);
}

}  // namespace
}  // namespace lightcuts
