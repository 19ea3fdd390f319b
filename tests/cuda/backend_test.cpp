#include <algorithm>
#include <cstdio>

#include "backend/backend.h"
#include "cuda/device_fixture.h"
#include "lightcuts/compare.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"

namespace lightcuts::cuda {
namespace {

/// The same stages on both processors.
class BothBackends : public OnDevice {
 protected:
  void open(const Scene& scene) {
    cpu = make_cpu_backend(0);
    gpu = make_cuda_backend(0, 0);
    for (Backend* backend : {cpu.get(), gpu.get()}) backend->set_scene(scene, {});
  }
  std::unique_ptr<Backend> cpu, gpu;
};

Scene valid(Scene scene) {
  validate(scene);
  return scene;
}

double relative_difference(Vec3 a, Vec3 b) { return length(a - b) / std::max(1e-6f, length(b)); }

/// VPLs that the GPU has in the CPU's place within 1e-4; both lists are in the order of paths, with some paths longer
/// in one than in the other.
double share_of_equal_vpls(const std::vector<Vpl>& a, const std::vector<Vpl>& b, float diagonal) {
  std::size_t i = 0, j = 0, equal = 0;
  const auto same = [&](std::size_t p, std::size_t q) {
    return length(a[p].position - b[q].position) < 1e-4f * diagonal && length(a[p].axis - b[q].axis) < 1e-3f &&
           relative_difference(a[p].intensity, b[q].intensity) < 1e-3;
  };
  while (i < a.size() && j < b.size()) {
    if (same(i, j)) {
      ++equal, ++i, ++j;
      continue;
    }
    // A path differs: look for the nearest place where both go on alike.
    bool found = false;
    for (std::size_t skip = 1; skip < 200 && !found; ++skip) {
      for (std::size_t k = 0; k <= skip && !found; ++k) {
        if (i + k < a.size() && j + skip - k < b.size() && same(i + k, j + skip - k)) {
          i += k, j += skip - k, found = true;
        }
      }
    }
    if (!found) ++i, ++j;
  }
  return static_cast<double>(equal) / static_cast<double>(std::max(a.size(), b.size()));
}

class Vpls : public BothBackends, public testing::WithParamInterface<const char*> {};

TEST_P(Vpls, AreTheCpusButForRounding) {
  const Scene scene = valid(make_builtin_scene(GetParam()));
  open(scene);
  for (const std::uint64_t count : {1, 100, 10007, 300000}) {
    if (reduced() && count > 20000) break;
    VplOptions options;
    options.count = count;
    cpu->trace_vpls(options, {});
    gpu->trace_vpls(options, {});
    const Lights &a = cpu->lights(), &b = gpu->lights();
    EXPECT_EQ(a.primary_count, b.primary_count);
    EXPECT_EQ(a.sky_count, b.sky_count);
    EXPECT_EQ(a.points.size(), b.points.size());
    EXPECT_EQ(a.directionals.size(), b.directionals.size());
    // A pilot path that rounding ends elsewhere shifts the plan a little, and with it every flux.
    EXPECT_NEAR(static_cast<double>(b.path_count) / static_cast<double>(a.path_count), 1, 1e-3);
    const double equal = share_of_equal_vpls(a.vpls, b.vpls, diagonal(scene_bounds(scene)));
    std::printf("  %s: %zu and %zu VPLs, %.4f %% equal\n", GetParam(), a.vpls.size(), b.vpls.size(), 100 * equal);
    if (count >= 100) {
      EXPECT_GE(equal, 0.999);
    }
  }
}
TEST_P(Vpls, ArePlacedForTheCameraAsTheCpuDoes) {
  // Rounding of a rating shifts which candidate a step falls on, but neither how many nor how much light in all.
  const Scene scene = valid(make_builtin_scene(GetParam()));
  open(scene);
  VplOptions options;
  options.count = 5000;
  options.placement = VplPlacement::camera;
  options.view = PlacementView{select_camera(scene, ""), 64, 48, 0.01f};
  cpu->trace_vpls(options, {});
  gpu->trace_vpls(options, {});
  const Lights &a = cpu->lights(), &b = gpu->lights();
  EXPECT_NEAR(static_cast<double>(b.vpls.size() + b.sky_count), 5000, 1);
  EXPECT_NEAR(static_cast<double>(a.primary_count), static_cast<double>(b.primary_count), 50);
  EXPECT_EQ(a.points.size(), b.points.size());
  const auto total = [](const Lights& lights) {
    double sum = 0;
    for (const Vpl& v : lights.vpls) sum += luminance(v.intensity);
    return sum;
  };
  EXPECT_NEAR(total(b) / total(a), 1, 0.02);
}
INSTANTIATE_TEST_SUITE_P(Scenes, Vpls, testing::Values("cornell", "study", "interior", "lamps?count=100", "furnace"));

class Pictures : public BothBackends, public testing::WithParamInterface<const char*> {};

TEST_P(Pictures, OverTheSameLightsAgree) {
  const Scene scene = valid(make_builtin_scene(GetParam()));
  open(scene);
  VplOptions vpls;
  vpls.count = reduced() ? 200 : 2000;
  const int width = reduced() ? 37 : 101, height = reduced() ? 25 : 67;
  cpu->trace_vpls(vpls, {});
  gpu->set_lights(cpu->lights());
  const Camera camera = select_camera(scene, "");
  for (const Visibility visibility : {Visibility::none, Visibility::rays, Visibility::ism}) {
    ShadeOptions options;
    options.ism_size = 32;
    options.ism_points = 2000;
    options.method = Method::instant_radiosity;
    options.visibility = visibility;
    Statistics of_cpu, of_gpu;
    const Image a = cpu->shade(camera, width, height, options, 0, of_cpu, {}).image;
    const Image b = gpu->shade(camera, width, height, options, 0, of_gpu, {}).image;
    const Comparison difference = compare(b, a);
    std::printf("  %s, %s: relmse %.2e, clamped %.6f and %.6f\n", GetParam(),
                visibility == Visibility::rays  ? "rays"
                : visibility == Visibility::ism ? "ism"
                                                : "none",
                difference.relmse, of_cpu.clamped, of_gpu.clamped);
    EXPECT_LT(difference.relmse, 1e-5);
    EXPECT_NEAR(of_gpu.clamped, of_cpu.clamped, 1e-4);
    EXPECT_EQ(of_gpu.pairs > 0, of_cpu.pairs > 0);
    // From run to run not a bit changes.
    Statistics again;
    const Image c = gpu->shade(camera, width, height, options, 0, again, {}).image;
    for (std::size_t k = 0; k < b.channels.size(); ++k) EXPECT_EQ(b.channels[k].values, c.channels[k].values);
  }
}

TEST_P(Pictures, OfPathsAgree) {
  const Scene scene = valid(make_builtin_scene(GetParam()));
  open(scene);
  ShadeOptions options;
  options.method = Method::path;
  options.samples = reduced() ? 16 : 64;
  Statistics statistics;
  const Camera camera = select_camera(scene, "");
  const Image a = cpu->shade(camera, 48, 48, options, 0, statistics, {}).image;
  const Image b = gpu->shade(camera, 48, 48, options, 0, statistics, {}).image;
  const Comparison difference = compare(b, a);
  std::printf("  %s: relmse %.2e, signed %.2e\n", GetParam(), difference.relmse, difference.signed_relative_error);
  EXPECT_LT(difference.relmse, 1e-3);  // the same paths, but where rounding parts them
  EXPECT_NEAR(difference.signed_relative_error, 0, 5e-3);
}
INSTANTIATE_TEST_SUITE_P(Scenes, Pictures,
                         testing::Values("cornell", "study", "interior", "lamps?count=100", "furnace"));

TEST_F(OnDevice, LightsAMillionVplsByMapsInBatches) {
  if (reduced()) GTEST_SKIP() << "too long under a checker";
  const Scene scene = valid(make_builtin_scene("study"));
  const auto gpu = make_cuda_backend(0, 0);
  gpu->set_scene(scene, {});
  VplOptions vpls;
  vpls.count = 1 << 20;
  gpu->trace_vpls(vpls, {});
  ShadeOptions options;
  options.method = Method::instant_radiosity;
  options.visibility = Visibility::ism;
  options.ism_size = 8;
  options.ism_points = 200;
  const Camera camera = select_camera(scene, "");
  const auto picture = [&](std::uint64_t memory_bytes) {
    Statistics statistics;
    const ShadeResult result = gpu->shade(camera, 13, 7, options, memory_bytes, statistics, {});
    EXPECT_TRUE(result.complete);
    EXPECT_GE(statistics.shadow_maps.count, 1000000u);
    return result.image;
  };
  // Room for all maps (200 bytes each, the records included), and for a tenth of them.
  const Comparison c = compare(picture(24u << 20), picture(1u << 30));
  EXPECT_EQ(c.relmse, 0);
}

TEST_F(OnDevice, RefusesMoreMemoryThanItsLimit) {
  Device small(0, 1 << 20);
  EXPECT_THROW(DeviceBuffer<float>(small, 1 << 20), Error);
  EXPECT_EQ(small.used(), 0u);
}

TEST_F(OnDevice, NamesDevicesThatDoNotExist) { EXPECT_THROW(make_cuda_backend(99, 0), Error); }

}  // namespace
}  // namespace lightcuts::cuda
