// What Renderer keeps on a GPU, and what happens to it where memory is short.

#include "render/renderer_promises.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "cuda/device_fixture.h"
#include "lightcuts/compare.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"

namespace lightcuts::cuda {
namespace {

Scene valid(const char* name) {
  Scene scene = make_builtin_scene(name);
  validate(scene);
  return scene;
}

TEST_F(OnDevice, RendererKeepsWhatItSays) {
  for (const Visibility visibility : {Visibility::ism, Visibility::rays, Visibility::none}) {
    if (reduced() && visibility != Visibility::ism) break;
    const Scene scene = valid("cornell");
    test::expect_renderer_keeps_what_it_says(scene, select_camera(scene, ""), BackendKind::cuda, visibility, reduced());
  }
}

TEST_F(OnDevice, RendererLetsVplsFollowTheCamera) {
  const Scene scene = valid("study");
  test::expect_vpls_follow_the_camera(scene, select_camera(scene, ""), BackendKind::cuda, reduced());
}

TEST_F(OnDevice, RendererRecoversFromWhatWasStoppedAndWhatFailed) {
  const Scene scene = valid("study");
  test::expect_renderer_recovers(scene, select_camera(scene, ""), BackendKind::cuda, reduced());
}

TEST_F(OnDevice, TreesOfAllBuildersGivePictures) {
  const Scene scene = valid("study");
  RenderOptions options = test::series_options(BackendKind::cuda, Visibility::none, reduced());
  options.vpls.count = reduced() ? 300 : 3000;
  for (const TreeBuilder builder : {TreeBuilder::agglomerative, TreeBuilder::ploc, TreeBuilder::morton}) {
    options.tree.builder = builder;
    options.backend = BackendKind::cuda;
    const RenderResult gpu = render(scene, select_camera(scene, ""), options);
    options.backend = BackendKind::cpu;
    const RenderResult cpu = render(scene, select_camera(scene, ""), options);
    EXPECT_EQ(gpu.statistics.tree.nodes, 2 * gpu.statistics.vpls.count - 1);
    EXPECT_GT(gpu.statistics.tree.depth, 10u);
    // A GPU's groups of pixels are larger than the CPU's, and so are their cuts.
    EXPECT_LT(gpu.statistics.cut.mean, 3 * cpu.statistics.cut.mean) << static_cast<int>(builder);
    EXPECT_GT(gpu.statistics.cut.mean, cpu.statistics.cut.mean / 2) << static_cast<int>(builder);
  }
}

// --- Faults ---

/// A cap on the device's allocator gives either the picture without one, or a sentence on memory.
class Capped : public OnDevice {
 protected:
  static void expect_picture_or_sentence(
      const RenderOptions& uncapped, const char* name,
      const std::function<std::unique_ptr<void, void (*)(void*)>(std::uint64_t)>& cap, bool by_option) {
    const Scene scene = valid("study");
    const Camera camera = select_camera(scene, "");
    const RenderResult expected = render(scene, camera, uncapped);
    const std::uint64_t peak = expected.statistics.memory_bytes.device_peak;
    int pictures = 0, refused = 0;
    const std::uint64_t most = std::max(2 * peak, std::uint64_t{64} << 20);
    const auto next = [most](std::uint64_t bytes) {
      return !reduced() ? bytes + bytes / 2 : bytes < most ? most : most + 1;
    };
    for (std::uint64_t bytes = reduced() ? 65536 : 4096; bytes <= most; bytes = next(bytes)) {
      RenderOptions options = uncapped;
      if (by_option) options.memory_bytes = bytes;
      const auto holder = cap(bytes);
      try {
        // In very little memory rounding may decide a few lookups in maps otherwise.
        EXPECT_LT(compare(render(scene, camera, options).image, expected.image).relmse, 1e-6) << name << ", " << bytes;
        ++pictures;
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), Code::out_of_memory) << bytes << ": " << error.what();
        EXPECT_NE(std::string(error.what()).find("--"), std::string::npos) << error.what();
        ++refused;
      }
    }
    std::printf("  %s: %d pictures, %d refused; peak without a cap %.1f MB\n", name, pictures, refused,
                static_cast<double>(peak) / 1e6);
    EXPECT_GT(pictures, 0) << name;
    EXPECT_GT(refused, 0) << name;
  }

  static void all_methods(const std::function<std::unique_ptr<void, void (*)(void*)>(std::uint64_t)>& cap,
                          bool by_option) {
    RenderOptions options = test::series_options(BackendKind::cuda, Visibility::ism, reduced());
    expect_picture_or_sentence(options, "cuts by maps", cap, by_option);
    options.shade.cut = CutWalk::heap;
    expect_picture_or_sentence(options, "heaps by maps", cap, by_option);
    options.shade.method = Method::instant_radiosity;
    expect_picture_or_sentence(options, "all lights by maps", cap, by_option);
    options = test::series_options(BackendKind::cuda, Visibility::rays, reduced());
    expect_picture_or_sentence(options, "cuts by rays", cap, by_option);
    options.shade.method = Method::path;
    options.shade.samples = 1;
    expect_picture_or_sentence(options, "paths", cap, by_option);
    options = test::series_options(BackendKind::cuda, Visibility::none, reduced());
    options.vpls.placement = VplPlacement::camera;
    expect_picture_or_sentence(options, "placed for the camera", cap, by_option);
  }
};

TEST_F(Capped, ByTheMemoryOption) {
  all_methods([](std::uint64_t) { return std::unique_ptr<void, void (*)(void*)>(nullptr, [](void*) {}); }, true);
}

TEST_F(Capped, ByMemoryThatOthersTook) {
  // As if the driver had no more: what was planned does not come true.
  all_methods(
      [](std::uint64_t bytes) {
        setenv("LIGHTCUTS_TEST_GPU_MEMORY", std::to_string(bytes).c_str(), 1);
        static int any = 0;
        return std::unique_ptr<void, void (*)(void*)>(&any, [](void*) { unsetenv("LIGHTCUTS_TEST_GPU_MEMORY"); });
      },
      false);
}

TEST(DeviceErrors, SayWhatToDo) {
  const auto said = [](cudaError_t status) {
    try {
      check(status, "testing");
    } catch (const Error& error) {
      return std::pair{error.code(), std::string(error.what())};
    }
    return std::pair{Code::invalid_argument, std::string()};
  };
  const auto expect = [&](cudaError_t status, Code code, const char* word) {
    const auto [got, words] = said(status);
    EXPECT_EQ(got, code) << words;
    EXPECT_NE(words.find(word), std::string::npos) << words;
  };
  expect(cudaErrorNoDevice, Code::no_device, "--backend cpu");
  expect(cudaErrorInsufficientDriver, Code::no_device, "driver");
  expect(cudaErrorNoKernelImageForDevice, Code::no_device, "LIGHTCUTS_CUDA_ARCHITECTURES");
  expect(cudaErrorMemoryAllocation, Code::out_of_memory, "--memory");
  expect(cudaErrorLaunchFailure, Code::no_device, "--backend cpu");
  expect(cudaErrorLaunchTimeout, Code::no_device, "--backend cpu");
  expect(cudaErrorDevicesUnavailable, Code::no_device, "--backend cpu");
}

}  // namespace
}  // namespace lightcuts::cuda
