#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <filesystem>

#include "cpu/path_tracer.h"
#include "lightcuts/io.h"
#include "lightcuts/render.h"

namespace lightcuts {
namespace {

struct Rgb {
  double r = 0, g = 0, b = 0;
};

Rgb mean_of(const std::vector<Vec3>& pixels) {
  Rgb sum;
  for (const Vec3 p : pixels) sum.r += p.x, sum.g += p.y, sum.b += p.z;
  const auto n = static_cast<double>(pixels.size());
  return {sum.r / n, sum.g / n, sum.b / n};
}

/// Another renderer's picture of the same scene: our scale, camera, normals and bounces against somebody else's.
TEST(PathTracer, CornellBoxHasTheMeanOfTheReferencePicture) {
  const std::filesystem::path folder = std::filesystem::path(LC_SHARED_SCENES) / "rooms/cornell-box";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the shared scenes are not here: put them beside the checkout";
  const LoadedScene loaded = load_scene(folder / "scene.gltf");
  const Rgb expected = mean_of(rgb_pixels(load_image(folder / "TungstenRender.exr")));

  const SceneArrays cpu(loaded.scene);
  const EmitterTable emitters(cpu);
  const RayTracer tracer(cpu.view());
  const PathTracer path(cpu, emitters, tracer, kUnlimitedBounces, 1);
  constexpr int kSize = 64, kSamplesPerPixel = 64;
  const CameraView camera = make_camera_view(select_camera(loaded.scene, ""), kSize, kSize);
  std::vector<Vec3> pixels(kSize * kSize);
  tbb::parallel_for(0, kSize, [&](int y) {
    for (int x = 0; x < kSize; ++x) {
      for (std::uint32_t s = 0; s < kSamplesPerPixel; ++s) {
        pixels[kSize * y + x] += path.radiance(camera, x, y, s) / static_cast<float>(kSamplesPerPixel);
      }
    }
  });
  const Rgb mean = mean_of(pixels);
  EXPECT_NEAR(mean.r / expected.r, 1, 0.01);
  EXPECT_NEAR(mean.g / expected.g, 1, 0.01);
  EXPECT_NEAR(mean.b / expected.b, 1, 0.01);
  RecordProperty("red", std::to_string(mean.r / expected.r));
  RecordProperty("green", std::to_string(mean.g / expected.g));
  RecordProperty("blue", std::to_string(mean.b / expected.b));
}

}  // namespace
}  // namespace lightcuts
