#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "cpu/path_tracer.h"
#include "cpu/vpl_tracer.h"
#include "cpu_core/scene_parts.h"
#include "lightcuts/error.h"
#include "oracle/vpl_sum.h"

namespace lightcuts {
namespace {

constexpr double kPiD = 3.14159265358979323846;

/// Closed unit cube; all walls emit 1 and have albedo r.
Scene furnace(float r) {
  Scene scene;
  test::add_material(scene, {r, r, r}, {1, 1, 1});
  test::place(scene, test::box({0, 0, 0}, {1, 1, 1}, 0, true));
  return scene;
}

Lights lights_of(const Scene& scene, const VplOptions& options) {
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view());
  return trace_vpls(cpu, tracer, options);
}

double flux_of(const std::vector<Vpl>& vpls, std::uint64_t first, std::uint64_t last) {
  double sum = 0;
  for (std::uint64_t i = first; i < last; ++i) sum += kPiD * vpls[i].intensity.y;
  return sum;
}

TEST(VplTracer, PrimarySamplesCarryTheFluxOfTheLights) {
  const Lights lights = lights_of(furnace(0.5f), {});
  EXPECT_NEAR(flux_of(lights.vpls, 0, lights.primary_count), 6 * kPiD, 1e-3);  // pi A L
}

TEST(VplTracer, BouncesCarryWhatTheSurfacesReflect) {
  for (const float r : {0.3f, 0.5f, 0.8f}) {
    for (const int bounces : {1, 2, 5, kUnlimitedBounces}) {
      VplOptions options;
      options.bounces = bounces;
      options.count = 40000;
      const Lights lights = lights_of(furnace(r), options);
      const double n = std::min(bounces, 64);
      const double expected = 6 * kPiD * r * (1 - std::pow(r, n)) / (1 - r);
      // The number of a path's deposits is about geometric: three standard errors.
      const double allowed = 3 * std::sqrt(r / static_cast<double>(lights.path_count));
      EXPECT_NEAR(flux_of(lights.vpls, lights.primary_count, lights.vpls.size()) / expected, 1, allowed)
          << "albedo " << r << " bounces " << bounces;
    }
  }
}

TEST(VplTracer, MeetsTheCountWithinFivePerCent) {
  Scene room = furnace(0.6f);
  room.materials[0].emission = {0, 0, 0};
  test::add_material(room, {0.1f, 0.3f, 0.9f}, {5, 5, 4});
  test::place(room, test::quad({0.4f, 0.99f, 0.4f}, {0.2f, 0, 0}, {0, 0, 0.2f}, 1));
  for (const Sequence sequence : {Sequence::sobol, Sequence::random}) {
    for (const std::uint64_t count : {50u, 300u, 1000u, 10000u, 100000u}) {
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        VplOptions options;
        options.count = count;
        options.seed = seed;
        options.sequence = sequence;
        const auto made = static_cast<double>(lights_of(room, options).count());
        EXPECT_NEAR(made / static_cast<double>(count), 1, 0.05)
            << count << " seed " << seed << (sequence == Sequence::sobol ? " sobol" : " random");
      }
    }
  }
}

TEST(VplTracer, FixedCountsBiasNothing) {
  // Few VPLs, often thinned out: over many seeds the mean flux is what the surfaces reflect.
  const Scene room = furnace(0.7f);
  const SceneArrays cpu(room);
  const EmitterTable emitters(cpu);
  const RayTracer tracer(cpu.view());
  double sum = 0, sum_sq = 0;
  constexpr int kSeeds = 400;
  for (int seed = 0; seed < kSeeds; ++seed) {
    VplOptions options;
    options.count = 60;
    options.seed = static_cast<std::uint64_t>(seed);
    const Lights lights = trace_vpls(cpu, emitters, tracer, options);
    const double flux = flux_of(lights.vpls, lights.primary_count, lights.vpls.size());
    sum += flux / kSeeds;
    sum_sq += flux * flux / kSeeds;
  }
  const double error = std::sqrt((sum_sq - sum * sum) / kSeeds);
  EXPECT_NEAR(sum, 6 * kPiD * 0.7 / 0.3, 3 * error);
  EXPECT_LT(error, 1);
}

TEST(VplTracer, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = furnace(0.7f);
  VplOptions options;
  options.count = 20000;
  const auto with_threads = [&](std::size_t n) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, n);
    return lights_of(scene, options);
  };
  const Lights one = with_threads(1), two = with_threads(2);
  ASSERT_EQ(one.vpls.size(), two.vpls.size());
  EXPECT_EQ(std::memcmp(one.vpls.data(), two.vpls.data(), one.vpls.size() * sizeof(Vpl)), 0);
}

TEST(VplTracer, StudyLayoutHasItsNumberOfLights) {
  VplOptions options;
  options.primary_lights = 30;
  options.vpls_per_light = 20;
  options.bounces = 1;
  const Lights lights = lights_of(furnace(0.5f), options);
  EXPECT_EQ(lights.primary_count, 30u);
  EXPECT_EQ(lights.path_count, 600u);
  EXPECT_EQ(lights.vpls.size(), 630u);
  EXPECT_NEAR(flux_of(lights.vpls, 30, 630), 3 * kPiD, 1e-3);
}

TEST(VplTracer, StudyDepositFallsOffWithTheSquare) {
  // A small light two metres over a floor: every VPL gets min(1, (D / t)^2) of its physical intensity.
  Scene scene;
  test::add_material(scene, {0.5f, 0.5f, 0.5f});
  test::add_material(scene, {0, 0, 0}, {1, 1, 1});
  test::place(scene, test::quad({-50, 0, 50}, {100, 0, 0}, {0, 0, -100}, 0));
  test::place(scene, test::quad({-0.001f, 2, -0.001f}, {0.002f, 0, 0}, {0, 0, 0.002f}, 1));
  VplOptions options;
  options.bounces = 1;
  options.primary_lights = 10;
  options.vpls_per_light = 100;
  const Lights physical = lights_of(scene, options);
  options.deposit = Deposit::study;
  options.deposit_distance = 3;
  const Lights study = lights_of(scene, options);
  ASSERT_EQ(physical.vpls.size(), study.vpls.size());
  for (std::size_t i = physical.primary_count; i < physical.vpls.size(); ++i) {
    const Vec3 p = physical.vpls[i].position;
    const double t_sq = p.x * p.x + 4 + p.z * p.z;
    EXPECT_NEAR(study.vpls[i].intensity.y / physical.vpls[i].intensity.y, std::min(1.0, 9 / t_sq), 2e-3);
  }
}

TEST(VplTracer, WithoutBouncesAllAreSamplesOfLights) {
  VplOptions options;
  options.bounces = 0;
  const Lights lights = lights_of(furnace(0.5f), options);
  EXPECT_EQ(lights.vpls.size(), 10000u);
  EXPECT_EQ(lights.primary_count, 10000u);
  EXPECT_EQ(lights.path_count, 0u);
}

TEST(VplTracer, PunctualLightsAndSkyShootVpls) {
  Scene scene = furnace(0.5f);
  scene.materials[0].emission = {0, 0, 0};
  scene.point_lights.push_back({{0.5f, 0.5f, 0.5f}, {2, 2, 2}});
  VplOptions options;
  options.bounces = 1;
  Lights lights = lights_of(scene, options);
  EXPECT_EQ(lights.points.size(), 1u);
  EXPECT_EQ(lights.primary_count, 0u);
  EXPECT_EQ(lights.vpls.size(), 10000u);
  EXPECT_NEAR(flux_of(lights.vpls, 0, lights.vpls.size()), 4 * kPiD * 2 * 0.5, 1e-3);

  // A sky of radiance 1 over an open floor brings the irradiance pi to each side of it.
  Scene open;
  test::add_material(open, {0.25f, 0.25f, 0.25f});
  test::place(open, test::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0));
  open.environment = Environment{};
  options.count = 100000;
  lights = lights_of(open, options);
  EXPECT_EQ(lights.primary_count, 0u);
  EXPECT_EQ(lights.directionals.size(), 25000u);
  EXPECT_NEAR(flux_of(lights.vpls, 0, lights.vpls.size()), 2 * kPiD * 4 * 0.25, 0.05);
  double from_above = 0;
  for (const DirectionalLight& d : lights.directionals) from_above += std::max(0.0f, -d.direction.y) * d.irradiance.y;
  EXPECT_NEAR(from_above, kPiD, 0.01);
  // The sun: E times the area that it sees.
  open.environment.reset();
  open.directional_lights.push_back({{0, -0.8f, 0.6f}, {3, 3, 3}});
  lights = lights_of(open, options);
  EXPECT_EQ(lights.directionals.size(), 1u);
  EXPECT_NEAR(flux_of(lights.vpls, 0, lights.vpls.size()), 3 * 4 * 0.8 * 0.25, 0.02);
}

TEST(VplTracer, DoubleSidedEmittersShineOnBothSides) {
  Scene scene = furnace(0.5f);
  scene.materials[0].emission = {0, 0, 0};
  test::add_material(scene, {0, 0, 0}, {2, 2, 2}, true);
  test::place(scene, test::quad({0.25f, 0.5f, 0.25f}, {0.5f, 0, 0}, {0, 0, 0.5f}, 1));
  const Lights lights = lights_of(scene, {});
  double up = 0, down = 0;
  for (std::size_t i = 0; i < lights.primary_count; ++i) {
    (lights.vpls[i].axis.y > 0 ? up : down) += lights.vpls[i].intensity.y;
  }
  EXPECT_NEAR(up, 0.5, 0.01);
  EXPECT_NEAR(down, 0.5, 0.01);
}

TEST(VplTracer, TexturedEmitterIsSampledWhereItShines) {
  // One texel in 64 is white: flux = pi A L / 64, and no VPL lies on the black ones.
  Scene scene = furnace(0.5f);
  scene.materials[0].emission = {0, 0, 0};
  test::add_material(scene, {0, 0, 0}, {64, 64, 64});
  TextureImage image;
  image.width = image.height = 8;
  image.channels = 3;
  image.texels.assign(3 * 64, 0);
  for (int c = 0; c < 3; ++c) image.texels[3 * (8 * 2 + 5) + c] = 255;
  scene.images.push_back(image);
  scene.materials[1].emission_texture.image = 0;
  scene.materials[1].emission_texture.nearest = true;
  // Cut into 16 x 16 cells, so that the table of triangles knows where the light is.
  Mesh panel;
  panel.material = 1;
  for (int y = 0; y <= 16; ++y) {
    for (int x = 0; x <= 16; ++x) {
      const float u = static_cast<float>(x) / 16, v = static_cast<float>(y) / 16;
      panel.positions.push_back({u, 0.99f, v});
      panel.texcoords[0].push_back({u, v});
    }
  }
  for (std::uint32_t y = 0; y < 16; ++y) {
    for (std::uint32_t x = 0; x < 16; ++x) {
      const std::uint32_t i = 17 * y + x;
      panel.triangles.push_back({i, i + 1, i + 17});
      panel.triangles.push_back({i + 1, i + 18, i + 17});
    }
  }
  test::place(scene, panel);
  const Lights lights = lights_of(scene, {});
  EXPECT_NEAR(flux_of(lights.vpls, 0, lights.primary_count), kPiD, 0.1);
  EXPECT_GT(lights.primary_count, 2300u);  // of 2500: the others fell on black texels
  for (std::size_t i = 0; i < lights.primary_count; ++i) {
    EXPECT_GE(lights.vpls[i].position.x, 5 / 8.0f - 1e-5f);
    EXPECT_LE(lights.vpls[i].position.x, 6 / 8.0f + 1e-5f);
  }
}

TEST(VplTracer, RefusesWhatCannotBeDone) {
  Scene dark = furnace(0.5f);
  dark.materials[0].emission = {0, 0, 0};
  try {
    lights_of(dark, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), Code::no_emitter);
  }
  VplOptions options;
  options.count = 0;
  EXPECT_THROW(lights_of(furnace(0.5f), options), Error);
  options.count = 10;
  options.deposit = Deposit::study;
  EXPECT_THROW(lights_of(furnace(0.5f), options), Error);
}

TEST(VplTracer, StopsWhenAskedTo) {
  const Scene scene = furnace(0.5f);
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view());
  EXPECT_EQ(trace_vpls(cpu, tracer, {}, [](const char*, double) { return false; }).count(), 0u);
}

TEST(VplTracer, DiscOverPlaneMatchesItsFormFactor) {
  // Reference section 10: E = pi L R^2 / (R^2 + h^2) on the axis, R = 0.5, h = 2, L = 1.
  Scene scene;
  test::add_material(scene, {0, 0, 0}, {1, 1, 1});
  Mesh disc;
  disc.positions.push_back({0, 2, 0});
  constexpr std::uint32_t kCorners = 256;
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    const float a = 2 * kPi * static_cast<float>(i) / static_cast<float>(kCorners);
    disc.positions.push_back({0.5f * std::cos(a), 2, 0.5f * std::sin(a)});
    disc.triangles.push_back({0, 1 + i, 1 + (i + 1) % kCorners});
  }
  test::place(scene, disc);
  const Lights lights = lights_of(scene, {});
  EXPECT_NEAR(oracle::irradiance(lights.vpls, {0, 0, 0}, {0, 1, 0}), 0.1848, 0.0002);
}

// ---- The path tracer

struct Mean {
  double value = 0, error = 0;
};

Mean mean_radiance(const Scene& scene, int bounces, Vec3 eye, Vec3 target, std::uint32_t samples) {
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view());
  const EmitterTable emitters(cpu);
  const PathTracer path(cpu, emitters, tracer, bounces, 3);
  double sum = 0, sum_sq = 0;
  // Independent streams: the spread between batches of a low-discrepancy sequence is the honest error.
  constexpr int kBatches = 32;
  for (int b = 0; b < kBatches; ++b) {
    const PathTracer batch(cpu, emitters, tracer, bounces, derive_seed(3, static_cast<std::uint64_t>(b)));
    double mean = 0;
    for (std::uint32_t i = 0; i < samples; ++i) {
      mean += batch.radiance_along({eye, 0, normalize(target - eye), kInfinity}, i).y / static_cast<float>(samples);
    }
    sum += mean / kBatches;
    sum_sq += mean * mean / kBatches;
  }
  return {sum, std::sqrt(std::max(sum_sq - sum * sum, 0.0) / (kBatches - 1))};
}

TEST(PathTracer, FurnaceHasItsKnownRadiance) {
  for (const float r : {0.0f, 0.3f, 0.5f, 0.8f}) {
    for (const int bounces : {0, 1, 3, 8, kUnlimitedBounces}) {
      const Mean m = mean_radiance(furnace(r), bounces, {0.4f, 0.5f, 0.45f}, {1, 0.3f, 0.6f}, 256);
      const double terms = bounces == kUnlimitedBounces ? 66 : bounces + 2;
      const double expected = (1 - std::pow(r, terms)) / (1 - r);
      EXPECT_NEAR(m.value, expected, 3 * m.error + 1e-5) << "albedo " << r << " bounces " << bounces;
      EXPECT_LT(m.error, 0.02 * expected);
    }
  }
}

TEST(PathTracer, SmallLightsOfEveryKindGiveTheirIrradiance) {
  Scene scene;
  test::add_material(scene, {0.5f, 0.5f, 0.5f});
  test::place(scene, test::quad({-100, 0, 100}, {200, 0, 0}, {0, 0, -200}, 0));
  const auto floor_radiance = [&](const Scene& s) { return mean_radiance(s, 0, {0.3f, 1, 0.2f}, {0, 0, 0}, 512); };

  Scene point = scene;
  point.point_lights.push_back({{0, 2, 0}, {8, 8, 8}});
  EXPECT_NEAR(floor_radiance(point).value, 8 / 4.0 * 0.5 / kPiD, 1e-4);
  Scene sun = scene;
  sun.directional_lights.push_back({{0.6f, -0.8f, 0}, {5, 5, 5}});
  EXPECT_NEAR(floor_radiance(sun).value, 5 * 0.8 * 0.5 / kPiD, 1e-4);
  Scene sky = scene;
  sky.environment = Environment{{2, 2, 2}, nullptr};
  EXPECT_NEAR(floor_radiance(sky).value, 1, 0.01);
  // An area light seen from its back is dark, from its front it gives its form factor.
  for (const bool front : {false, true}) {
    Scene area = scene;
    test::add_material(area, {0, 0, 0}, {1, 1, 1});
    const Vec3 a{1, 0, 0}, b{0, 0, 1};
    test::place(area, test::quad({-0.5f, 2, -0.5f}, front ? a : b, front ? b : a, 1));
    // Form factor of a unit square two metres above: 4 corners of 0.5 x 0.5 each.
    const double x = 0.25, f = 4 / (2 * kPiD) * 2 * (x / std::sqrt(1 + x * x) * std::atan(x / std::sqrt(1 + x * x)));
    const Mean m = floor_radiance(area);
    EXPECT_NEAR(m.value, front ? 0.5 * f : 0, 3 * m.error + 1e-6);
  }
}

TEST(PathTracer, AgreesWithVplsUnderBentShadingNormals) {
  // A room whose shading normals lean: the photon's factor and the receiver's cosine must be each other's adjoint, so
  // light that is carried to a receiver once by VPLs and once by paths must be the same.
  Scene scene;
  test::add_material(scene, {0.7f, 0.7f, 0.7f});
  test::add_material(scene, {0, 0, 0}, {3, 3, 3});
  Mesh wall = test::quad({-1, 0, -1}, {0, 0, 2}, {0, 2, 0}, 0);  // faces -x or +x: both sides count
  wall.normals.assign(4, normalize(Vec3{-1, 0.8f, 0.3f}));
  test::place(scene, wall);
  test::place(scene, test::quad({0.2f, 2, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 1));
  Mesh receiver = test::quad({0.6f, 0, 0.5f}, {1, 0, 0}, {0, 0, -1}, 0);
  test::place(scene, receiver);
  VplOptions options;
  options.count = 200000;
  options.bounces = 1;
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view());
  const Lights lights = trace_vpls(cpu, tracer, options);
  const Vec3 at{1, 1e-5f, 0};
  double sum = 0;
  for (const Vpl& v : lights.vpls) {
    if (!tracer.occluded(shadow_ray(at, v.position))) sum += oracle::irradiance({v}, at, {0, 1, 0});
  }
  const Mean path = mean_radiance(scene, 1, {1, 0.5f, 0}, {1, 0, 0}, 4096);
  EXPECT_NEAR(sum * 0.7 / kPiD / path.value, 1, 0.01 + 3 * path.error / path.value);
}

}  // namespace
}  // namespace lightcuts
