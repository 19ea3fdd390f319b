#include <tbb/parallel_for.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "backend/scene_arrays.h"
#include "backend/surface_rays.h"
#include "cpu/ray_tracer.h"
#include "cuda/device_fixture.h"
#include "cuda/device_scene.h"
#include "cuda/ray_kernels.h"
#include "lightcuts/io.h"

namespace lightcuts::cuda {
namespace {

class RaysOnScene : public OnDevice {
 protected:
  void compare(const Scene& scene, std::uint32_t count) {
    const SceneArrays host(scene);
    const RayTracer embree(host.view());
    const DeviceScene on_device(*device, scene, host.view());
    const std::vector<Ray> rays = surface_rays(host.view(), count, 5);
    DeviceBuffer<Ray> device_rays(*device, count);
    device_rays.upload(rays.data(), count);
    DeviceBuffer<Hit> device_hits(*device, count);
    DeviceBuffer<std::uint8_t> device_blocked(*device, count);
    std::vector<Hit> hits(count);
    std::vector<std::uint8_t> blocked(count);
    for (int run = 0; run < 3; ++run) {
      cudaEvent_t e[3];
      for (auto& event : e) cudaEventCreate(&event);
      cudaEventRecord(e[0], device->stream());
      trace_nearest(*device, on_device.view(), on_device.bvh(), device_rays.data(), device_hits.data(), count);
      cudaEventRecord(e[1], device->stream());
      trace_any(*device, on_device.view(), on_device.bvh(), device_rays.data(), device_blocked.data(), count);
      cudaEventRecord(e[2], device->stream());
      device->synchronize();
      float nearest_ms = 0, any_ms = 0;
      cudaEventElapsedTime(&nearest_ms, e[0], e[1]);
      cudaEventElapsedTime(&any_ms, e[1], e[2]);
      if (run == 2) {
        RecordProperty("nearest_Mrays_per_s", static_cast<int>(static_cast<double>(count) / nearest_ms / 1e3));
        RecordProperty("any_Mrays_per_s", static_cast<int>(static_cast<double>(count) / any_ms / 1e3));
        std::printf("  %u triangles, %u nodes; incoherent rays: nearest %.2f G/s, any %.2f G/s\n",
                    on_device.triangle_count(), on_device.node_count(), static_cast<double>(count) / nearest_ms / 1e6,
                    static_cast<double>(count) / any_ms / 1e6);
      }
      for (auto& event : e) cudaEventDestroy(event);
    }
    device_hits.download(hits.data(), count);
    device_blocked.download(blocked.data(), count);
    std::atomic<std::uint32_t> hit_or_miss{0}, other_triangle{0}, any_differs{0}, hit_count{0};
    tbb::parallel_for(0u, count, [&](std::uint32_t i) {
      const Hit expected = embree.intersect(rays[i]);
      hit_count += expected.valid();
      any_differs += (blocked[i] != 0) != hits[i].valid();
      if (expected.valid() != hits[i].valid()) {
        ++hit_or_miss;
      } else if (expected.valid() &&
                 std::abs(expected.t - hits[i].t) > 1e-4f * expected.t + 1e-6f * host.view().diagonal) {
        ++other_triangle;
      }
    });
    std::printf("  of %u rays (%u hits): %u differ in hit or miss, %u in distance, %u between any and nearest\n", count,
                hit_count.load(), hit_or_miss.load(), other_triangle.load(), any_differs.load());
    EXPECT_LE(hit_or_miss.load(), 1 + count / 1000000);
    EXPECT_LE(other_triangle.load(), 1 + count / 100000);  // grazing rays: neither is exact
    EXPECT_EQ(any_differs.load(), 0u);
  }
};

std::uint32_t ray_count() {
  const char* words = std::getenv("LIGHTCUTS_TEST_RAYS");
  if (words != nullptr) return static_cast<std::uint32_t>(std::atol(words));
  return reduced() ? 20000 : 1000000;
}

TEST_F(RaysOnScene, Study) { compare(make_builtin_scene("study"), ray_count()); }
TEST_F(RaysOnScene, Interior) { compare(make_builtin_scene("interior"), ray_count()); }
TEST_F(RaysOnScene, Lamps) { compare(make_builtin_scene("lamps?count=1000&kind=quad"), ray_count()); }

TEST_F(RaysOnScene, SharedRooms) {
  const char* folder = std::getenv("LIGHTCUTS_SCENES");
  const std::filesystem::path rooms = std::filesystem::path(folder != nullptr ? folder : LC_SHARED_SCENES) / "rooms";
  if (!std::filesystem::exists(rooms)) GTEST_SKIP() << "no shared scenes here";
  for (const auto& room : std::filesystem::directory_iterator(rooms)) {
    const auto file = room.path() / "scene.gltf";
    if (!std::filesystem::exists(file)) continue;
    std::printf("%s\n", room.path().filename().c_str());
    compare(load_scene(file).scene, ray_count());
  }
}

}  // namespace
}  // namespace lightcuts::cuda
