#include "lightcuts/render.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "cpu/path_tracer.h"
#include "cpu/ray_tracer.h"
#include "cpu_shade/rooms.h"
#include "lightcuts/compare.h"
#include "lightcuts/error.h"
#include "lightcuts/version.h"

namespace lightcuts {
namespace {

RenderOptions small(int size = 32) {
  RenderOptions options;
  options.width = options.height = size;
  options.vpls.count = 1000;
  return options;
}

double mean(const Image& image, const char* name) {
  const std::vector<float>& values = find_channel(image, name)->values;
  double sum = 0;
  for (const float v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

TEST(Render, FillsPlanesStatisticsAndTimes) {
  const Scene scene = lit_room();
  const RenderResult result = render(scene, room_camera(), small());
  EXPECT_TRUE(result.complete);
  EXPECT_GT(mean(result.image, "G"), 0.05);
  for (const char* name : {"R", "G", "B", "albedo.R", "normal.Z", "depth.Z"}) {
    EXPECT_NE(find_channel(result.image, name), nullptr) << name;
  }
  const Statistics& s = result.statistics;
  EXPECT_EQ(s.device.substr(0, 5), "cpu: ");
  EXPECT_EQ(s.scene.triangles, 16u);
  EXPECT_EQ(s.scene.emitters, 2u);
  EXPECT_NEAR(static_cast<double>(s.vpls.count), 1000, 50);
  EXPECT_NEAR(static_cast<double>(s.vpls.primary), 250, 25);
  EXPECT_EQ(s.pairs, 32 * 32 * s.vpls.count);
  EXPECT_GT(s.rays, s.pairs / 20);
  EXPECT_GT(s.time_ms.shade, 0);
  EXPECT_GE(s.time_ms.total, s.time_ms.shade);
  EXPECT_GT(s.memory_bytes.host_peak, 1'000'000u);
  EXPECT_TRUE(result.warnings.empty());
}

TEST(Render, CountsSamplesOfTheEnvironmentAmongTheVpls) {
  Scene scene = lit_room();
  scene.environment = Environment{};
  const RenderResult result = render(scene, room_camera(), small(8));
  EXPECT_NEAR(static_cast<double>(result.statistics.vpls.count), 1000, 50);
  EXPECT_NEAR(static_cast<double>(result.statistics.vpls.primary), 250, 25);
  EXPECT_TRUE(result.warnings.empty());
}

TEST(Render, RefusesACameraWithoutAPlaceOrAView) {
  const auto refuses = [](auto spoil) {
    Camera camera = room_camera();
    spoil(camera);
    try {
      render(lit_room(), camera, small(4));
    } catch (const Error& error) {
      return error.code() == Code::invalid_argument;
    }
    return false;
  };
  EXPECT_TRUE(refuses([](Camera& c) { c.world_from_camera.origin.x = std::nanf(""); }));
  EXPECT_TRUE(refuses([](Camera& c) { c.world_from_camera.origin.x = 1e30f; }));
  EXPECT_TRUE(refuses([](Camera& c) { c.world_from_camera.z.y = std::numeric_limits<float>::infinity(); }));
  EXPECT_TRUE(refuses([](Camera& c) { c.vertical_fov_rad = 4; }));
  EXPECT_TRUE(refuses([](Camera& c) { c.orthographic_height = -1; }));
  EXPECT_FALSE(refuses([](Camera&) {}));
}

TEST(Render, ChoosesTheSize) {
  Scene scene = lit_room();
  Camera camera = room_camera();
  RenderOptions options = small(0);
  options.shade.visibility = Visibility::none;
  options.vpls.count = 1;
  options.width = 40;
  camera.aspect = 2;
  EXPECT_EQ(render(scene, camera, options).image.height, 20);
  scene.width = 30;
  scene.height = 10;
  options.width = 0;
  EXPECT_EQ(render(scene, camera, options).image.width, 30);
  options.height = 5;
  EXPECT_EQ(render(scene, camera, options).image.width, 15);
}

TEST(Render, RefusesOptionsOutOfRange) {
  const Scene scene = lit_room();
  const auto refused = [&](auto change) {
    RenderOptions options = small(4);
    change(options);
    try {
      render(scene, room_camera(), options);
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::invalid_argument) << error.what();
    }
  };
  refused([](RenderOptions& o) { o.width = -1; });
  refused([](RenderOptions& o) { o.height = 1 << 20; });
  refused([](RenderOptions& o) { o.vpls.count = 0; });
  refused([](RenderOptions& o) { o.vpls.primary_lights = 3; });
  refused([](RenderOptions& o) { o.vpls.primary_lights = o.vpls.vpls_per_light = 1u << 20; });
  refused([](RenderOptions& o) { o.vpls.deposit = Deposit::study; });
  refused([](RenderOptions& o) { o.vpls.bounces = -1; });
  refused([](RenderOptions& o) { o.shade.error = 0; });
  refused([](RenderOptions& o) { o.shade.error = std::nanf(""); });
  refused([](RenderOptions& o) { o.shade.min_distance = std::nanf(""); });
  refused([](RenderOptions& o) { o.shade.samples = -1; });
  refused([](RenderOptions& o) { o.shade.ism_size = 48; });
  refused([](RenderOptions& o) { o.threads = -1; });
}

TEST(Render, SaysWhatIsNotBuiltAndThatNothingEmits) {
  const auto code_of = [](const Scene& scene, const RenderOptions& options) {
    try {
      render(scene, room_camera(), options);
    } catch (const Error& error) {
      return error.code();
    }
    return Code::disk_full;  // not thrown here
  };
  RenderOptions options = small(4);
  EXPECT_EQ(code_of(closed_room({0.5f, 0.5f, 0.5f}), options), Code::no_emitter);
  options.backend = BackendKind::cuda;
  options.device = 1000;  // no machine has so many
  EXPECT_EQ(code_of(lit_room(), options), built_with_cuda() ? Code::no_device : Code::not_built);
}

TEST(Render, StoppedBeforeItsPixelsItReturnsAnEmptyPicture) {
  const auto stop = [](const char*, double) { return false; };
  const RenderResult result = render(lit_room(), room_camera(), small(8), stop);
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(mean(result.image, "weight"), 0);
  EXPECT_EQ(result.image.attributes.at("complete"), "false");
}

/// The furnace: every wall emits L_e = 1 and reflects r, so that after B + 1 reflections each pixel shows
/// (1 - r^(B+2)) / (1 - r), whatever its place.
Scene furnace(float albedo) {
  Scene scene = closed_room({albedo, albedo, albedo});
  scene.materials[0].emission = {1, 1, 1};
  return scene;
}

double furnace_radiance(double albedo, int bounces) {
  if (bounces == kUnlimitedBounces) return 1 / (1 - albedo);
  return (1 - std::pow(albedo, bounces + 2)) / (1 - albedo);
}

class Furnace : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Bounces, Furnace, testing::Values(0, 1, 2, kUnlimitedBounces),
                         [](const testing::TestParamInfo<int>& parameter) {
                           return parameter.param == kUnlimitedBounces ? "inf" : std::to_string(parameter.param);
                         });

TEST_P(Furnace, InstantRadiosityMeetsTheClosedForm) {
  for (const float albedo : {0.3f, 0.7f}) {
    RenderOptions options = small(32);
    options.vpls.count = 10'000;
    options.vpls.bounces = GetParam();
    options.shade.min_distance = 0;
    const RenderResult result = render(furnace(albedo), room_camera(), options);
    EXPECT_NEAR(mean(result.image, "R") / furnace_radiance(albedo, GetParam()), 1, 0.01);
    EXPECT_EQ(result.statistics.clamped, 0);
  }
}

TEST_P(Furnace, PlacingForTheCameraChangesNoMean) {
  RenderOptions options = small(32);
  options.vpls.count = 4'000;
  options.vpls.bounces = GetParam();
  options.vpls.placement = VplPlacement::camera;
  options.backend = BackendKind::cpu;
  options.shade.min_distance = 0;
  const RenderResult result = render(furnace(0.7f), room_camera(), options);
  EXPECT_NEAR(mean(result.image, "R") / furnace_radiance(0.7, GetParam()), 1, 0.01);
  EXPECT_NEAR(static_cast<double>(result.statistics.vpls.count), 4'000, 1);
}

TEST_P(Furnace, PathTracingMeetsTheClosedForm) {
  RenderOptions options = small(32);
  options.shade.method = Method::path;
  options.shade.bounces = GetParam();
  options.shade.samples = 64;
  const RenderResult result = render(furnace(0.5f), room_camera(), options);
  const double expected = furnace_radiance(0.5, GetParam());
  EXPECT_NEAR(mean(result.image, "G") / expected, 1, 0.005);
}

/// Path-traced picture whose samples all go through the pixels' centres, as the only sample of Instant Radiosity does:
/// antialiasing would hide what is compared behind the noise of a lamp's edge.
Image path_traced_at_centres(const Scene& scene, const Camera& camera, int size, std::uint32_t samples) {
  const SceneArrays cpu_scene(scene);
  const RayTracer tracer(cpu_scene.view());
  const EmitterTable emitters(cpu_scene);
  const PathTracer paths(cpu_scene, emitters, tracer, kUnlimitedBounces, 1);
  const CameraView view = make_camera_view(camera, size, size);
  Image image = make_rgb_image(size, size);
  tbb::parallel_for(0, size * size, [&](int i) {
    const Ray ray = camera_ray(view, static_cast<float>(i % size) + 0.5f, static_cast<float>(i / size) + 0.5f);
    Vec3T<double> sum;
    for (std::uint32_t s = 0; s < samples; ++s) {
      const Vec3 radiance = paths.radiance_along(ray, static_cast<std::uint32_t>(i) * samples + s);
      sum += {radiance.x, radiance.y, radiance.z};
    }
    const auto pixel = static_cast<std::size_t>(i);
    image.channels[0].values[pixel] = static_cast<float>(sum.x / samples);
    image.channels[1].values[pixel] = static_cast<float>(sum.y / samples);
    image.channels[2].values[pixel] = static_cast<float>(sum.z / samples);
  });
  return image;
}

TEST(Render, InstantRadiosityApproachesThePathTracer) {
  const Scene scene = make_builtin_scene("cornell");
  const Camera camera = select_camera(scene, "");
  constexpr int size = 32;
  const Image expected = path_traced_at_centres(scene, camera, size, 512);
  const auto compared_with = [&](std::uint64_t vpls) {
    RenderOptions options = small(size);
    options.vpls.count = vpls;
    return compare(render(scene, camera, options).image, expected);
  };
  const Comparison few = compared_with(300), many = compared_with(10'000);
  RecordProperty("relmse_300", std::to_string(few.relmse));
  RecordProperty("relmse_10000", std::to_string(many.relmse));
  EXPECT_LT(many.relmse, 0.005);
  EXPECT_LT(many.relmse, few.relmse / 5);
  EXPECT_NEAR(many.signed_relative_error, 0, 0.02);
}

}  // namespace
}  // namespace lightcuts
