#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <numeric>

#include "backend/vpl_placement.h"
#include "cpu/vpl_tracer.h"
#include "cpu_core/scene_parts.h"
#include "lightcuts/error.h"
#include "oracle/vpl_sum.h"

namespace lightcuts {
namespace {

// ---- The choice

std::vector<std::uint32_t> in_order(std::size_t count) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

TEST(KeepByWorth, EachIsKeptAsOftenAsItsWeightSays) {
  // Over an even comb of starts the share of times that a candidate is kept is its probability, to one tooth.
  const std::vector<float> worth{0, 1, 2, 0, 40, 3, 3, 0.5f, 0, 100, 7, 1};
  constexpr int kStarts = 5000;
  constexpr std::uint64_t kWanted = 5;
  std::vector<int> kept(worth.size(), 0);
  std::vector<float> weight(worth.size(), 0);
  for (int k = 0; k < kStarts; ++k) {
    const auto choice = keep_by_worth(worth, in_order(worth.size()), kWanted, (k + 0.5) / kStarts);
    EXPECT_NEAR(static_cast<double>(choice.size()), kWanted, 1);
    for (const KeptLight& c : choice) {
      ++kept[c.index];
      weight[c.index] = c.weight;
    }
  }
  double expected = 0;
  for (std::size_t i = 0; i < worth.size(); ++i) {
    ASSERT_GT(kept[i], 0) << i;
    EXPECT_NEAR(static_cast<double>(kept[i]) / kStarts, 1 / weight[i], 1.0 / kStarts) << i;
    expected += 1 / weight[i];
  }
  EXPECT_NEAR(expected, kWanted, 1e-5);
  EXPECT_EQ(weight[9], 1);           // worth more than its share: always there
  EXPECT_EQ(weight[1], weight[11]);  // the same worth, the same weight
  EXPECT_GT(weight[0], weight[1]);
}

TEST(KeepByWorth, TheBrightestIsBounded) {
  std::vector<float> worth(16000, 0.0f);
  for (std::size_t i = 0; i < 100; ++i) worth[i] = 1;
  for (const KeptLight& c : keep_by_worth(worth, in_order(worth.size()), 1000, 0.3)) {
    EXPECT_LE(c.weight, 6 * 16.0f);  // six times what one of a thousand without placement would carry
  }
}

TEST(KeepByWorth, WhatTheOrderPutsSideBySideIsThinnedEvenly) {
  const std::vector<float> worth(1000, 1.0f);
  const auto kept = keep_by_worth(worth, in_order(1000), 100, 0.5);
  ASSERT_EQ(kept.size(), 100u);
  for (std::size_t i = 0; i + 1 < kept.size(); ++i) EXPECT_NEAR(kept[i + 1].index - kept[i].index, 10, 1);
}

TEST(KeepByWorth, WorthlessOrFewCandidatesAreAllAlike) {
  for (const KeptLight& c : keep_by_worth(std::vector<float>(50, 0.0f), in_order(50), 10, 0)) {
    EXPECT_FLOAT_EQ(c.weight, 5);
  }
  EXPECT_EQ(keep_by_worth({1, 2, 3}, in_order(3), 3, 0.9).size(), 3u);
}

// ---- The whole

/// Two closed rooms of a metre, joined by a gap at the end of the wall between them; the lamp hangs in the first, the
/// camera stands in the second.
Scene two_rooms() {
  Scene scene;
  test::add_material(scene, {0.6f, 0.6f, 0.6f});
  test::add_material(scene, {0, 0, 0}, {20, 20, 20});
  test::place(scene, test::box({0, 0, 0}, {2, 1, 1}, 0, true));
  test::place(scene, test::quad({1, 0, 0}, {0, 1, 0}, {0, 0, 0.9f}, 0));
  test::place(scene, test::quad({0.3f, 0.99f, 0.3f}, {0.2f, 0, 0}, {0, 0, 0.2f}, 1));
  return scene;
}

Camera camera_at(Vec3 eye, Vec3 target) {
  Camera camera;
  const Vec3 back = normalize(eye - target), right = normalize(cross({0, 1, 0}, back));
  camera.world_from_camera = {right, cross(back, right), back, eye};
  camera.vertical_fov_rad = 1;
  return camera;
}

VplOptions for_camera(std::uint64_t count) {
  VplOptions options;
  options.count = count;
  options.placement = VplPlacement::camera;
  options.view = PlacementView{camera_at({1.9f, 0.5f, 0.9f}, {1.2f, 0.2f, 0.1f}), 64, 48, 0.01f};
  return options;
}

/// A scene ready for many tracings.
struct Loaded {
  explicit Loaded(const Scene& s) : scene(s), arrays(scene), tracer(arrays.view()), emitters(arrays) {}
  [[nodiscard]] Lights lights(const VplOptions& options) const { return trace_vpls(arrays, emitters, tracer, options); }

  Scene scene;
  SceneArrays arrays;
  RayTracer tracer;
  EmitterTable emitters;
};

struct Mean {
  double value = 0, error = 0, relative_variance = 0;
};

template <class Measure>
Mean over_seeds(const Loaded& loaded, VplOptions options, int seeds, Measure measure) {
  double sum = 0, sum_sq = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const double x = measure(loaded.lights(options));
    sum += x / seeds;
    sum_sq += x * x / seeds;
  }
  const double variance = std::max(sum_sq - sum * sum, 0.0);
  return {sum, std::sqrt(variance / (seeds - 1)), variance / (sum * sum)};
}

double flux(const Lights& lights) {
  double sum = 0;
  for (const Vpl& v : lights.vpls) sum += v.intensity.y;
  return sum;
}

TEST(CameraPlacement, KeepsTheEnergyAndTheLightAtAPoint) {
  const Loaded loaded(two_rooms());
  const auto at_floor = [&](const Lights& lights) {
    const Vec3 at{1.4f, 1e-5f, 0.4f};
    double sum = 0;
    for (const Vpl& v : lights.vpls) {
      if (!loaded.tracer.occluded(shadow_ray(at, v.position))) sum += oracle::irradiance({v}, at, {0, 1, 0});
    }
    return sum;
  };
  VplOptions many;
  many.count = 100000;
  const Mean all = over_seeds(loaded, for_camera(300), 60, flux);
  EXPECT_NEAR(all.value, flux(loaded.lights(many)), 3 * all.error);
  EXPECT_LT(all.error, 0.05 * all.value);

  const Mean placed = over_seeds(loaded, for_camera(300), 60, at_floor);
  const Mean truth = over_seeds(loaded, many, 4, at_floor);
  EXPECT_NEAR(placed.value, truth.value, 3 * (placed.error + truth.error));
  EXPECT_LT(placed.error, 0.04 * placed.value);

  // What it is for: far less variance where the camera looks.
  VplOptions power;
  power.count = 300;
  const Mean unplaced = over_seeds(loaded, power, 60, at_floor);
  EXPECT_LT(placed.relative_variance, 0.2 * unplaced.relative_variance);
}

TEST(CameraPlacement, MeetsTheCount) {
  const Loaded loaded(two_rooms());
  for (const std::uint64_t count : {1u, 20u, 1000u, 3000u}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      VplOptions options = for_camera(count);
      options.seed = seed;
      EXPECT_NEAR(static_cast<double>(loaded.lights(options).count()), static_cast<double>(count), 1);
    }
  }
}

TEST(CameraPlacement, AreaLightSamplesComeFirst) {
  const Loaded loaded(two_rooms());
  const Lights lights = loaded.lights(for_camera(2000));
  ASSERT_GT(lights.primary_count, 0u);
  for (std::size_t i = 0; i < lights.vpls.size(); ++i) {
    const bool on_lamp = std::fabs(lights.vpls[i].position.y - 0.99f) < 1e-4f && lights.vpls[i].axis.y < -0.5f;
    EXPECT_EQ(on_lamp, i < lights.primary_count) << i;
  }
}

TEST(CameraPlacement, SkySamplesAreChosenToo) {
  // A floor under the sky, open above, seen by a camera; the irradiance on it is pi whatever is kept.
  Scene open;
  test::add_material(open, {0.25f, 0.25f, 0.25f});
  test::place(open, test::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0));
  open.environment = Environment{};
  open.directional_lights.push_back({{0, -1, 0}, {2, 2, 2}});
  const Loaded loaded(open);
  VplOptions options = for_camera(500);
  options.view->camera = camera_at({0, 1.5f, 0.1f}, {0, 0, 0});
  const auto irradiance = [](const Lights& lights) {
    double sum = 0;
    for (std::size_t i = 0; i < lights.sky_count; ++i) {
      const DirectionalLight& d = lights.directionals[i];
      sum += std::max(0.0f, -d.direction.y) * d.irradiance.y;
    }
    return sum;
  };
  const Mean mean = over_seeds(loaded, options, 40, irradiance);
  EXPECT_NEAR(mean.value, 3.14159265, 3 * mean.error + 1e-4);
  EXPECT_LT(mean.error, 0.01);
  const Lights lights = loaded.lights(options);
  EXPECT_EQ(lights.directionals.size(), lights.sky_count + 1);  // the sun stays
  EXPECT_EQ(lights.directionals.back().irradiance.y, 2);
}

TEST(CameraPlacement, DoesNotDependOnTheNumberOfThreads) {
  const Loaded loaded(two_rooms());
  const auto with_threads = [&](std::size_t n) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, n);
    return loaded.lights(for_camera(2000));
  };
  const Lights one = with_threads(1), two = with_threads(2);
  ASSERT_EQ(one.vpls.size(), two.vpls.size());
  EXPECT_EQ(std::memcmp(one.vpls.data(), two.vpls.data(), one.vpls.size() * sizeof(Vpl)), 0);
}

TEST(CameraPlacement, ACameraThatSeesNothingKeepsAnEvenChoice) {
  const Loaded loaded(two_rooms());
  VplOptions options = for_camera(1000);
  options.view->camera = camera_at({0, 50, 0}, {0, 100, 1});
  const Mean all = over_seeds(loaded, options, 20, flux);
  VplOptions many;
  many.count = 100000;
  EXPECT_NEAR(all.value, flux(loaded.lights(many)), 3 * all.error);
}

TEST(CameraPlacement, StopsWhenAskedTo) {
  const Loaded loaded(two_rooms());
  const auto late = [](const char*, double done) { return done < 0.5; };
  EXPECT_EQ(trace_vpls(loaded.arrays, loaded.tracer, for_camera(2000), late).count(), 0u);
}

TEST(CameraPlacement, RefusesWhatContradictsIt) {
  const Loaded loaded(two_rooms());
  VplOptions options = for_camera(100);
  options.view.reset();
  EXPECT_THROW(static_cast<void>(loaded.lights(options)), Error);
  options = for_camera(100);
  options.primary_lights = options.vpls_per_light = 10;
  EXPECT_THROW(static_cast<void>(loaded.lights(options)), Error);
}

}  // namespace
}  // namespace lightcuts
