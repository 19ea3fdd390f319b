#include "bench_study/gpu_atlas.h"

#include "lightcuts/error.h"

#if defined(LIGHTCUTS_HAS_CUDA)

#include "bench_study/atlas.h"
#include "cuda/device.h"
#include "cuda/fill_atlas.h"

namespace lightcuts::app::study {
namespace {

using Codes = std::vector<std::uint16_t>;
using cuda::check;

constexpr int kWarmUp = 1;

/// Time between two moments of a device's stream.
class Events {
 public:
  Events() {
    check(cudaEventCreate(&start_), "timing");
    check(cudaEventCreate(&end_), "timing");
  }
  ~Events() {
    cudaEventDestroy(start_);
    cudaEventDestroy(end_);
  }
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;

  template <class Work>
  double seconds(cudaStream_t stream, const Work& work) {
    check(cudaEventRecord(start_, stream), "timing");
    work();
    check(cudaEventRecord(end_, stream), "timing");
    check(cudaEventSynchronize(end_), "timing");
    float ms = 0;
    check(cudaEventElapsedTime(&ms, start_, end_), "timing");
    return ms / 1e3;
  }

 private:
  cudaEvent_t start_ = nullptr, end_ = nullptr;
};

std::size_t differing(const cuda::DeviceBuffer<std::uint16_t>& on_device, const Codes& expected) {
  Codes codes(expected.size());
  on_device.download(codes.data(), codes.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) count += codes[i] != expected[i] ? 1 : 0;
  return count;
}

}  // namespace

Json time_gpu_atlas(int device_index, const Codes& atlas, const Codes& filled, int side, int repeats) {
  cuda::Device device(device_index, 0);
  cuda::DeviceBuffer<std::uint16_t> fresh(device, atlas.size()), texture(device, atlas.size());
  cuda::DeviceBuffer<std::uint16_t> coarser(device, cuda::atlas_scratch(side, kAtlasLevels));
  fresh.upload(atlas.data(), atlas.size());
  Events events;
  Json found = Json::object();
  std::size_t wrong = 0;
  const auto measure = [&](const char* name, const auto& fill) {
    std::vector<Time> times;
    for (int run = -kWarmUp; run < repeats; ++run) {
      check(cudaMemcpyAsync(texture.data(), fresh.data(), fresh.bytes(), cudaMemcpyDeviceToDevice, device.stream()),
            "copying the atlas");
      const double seconds = events.seconds(device.stream(), fill);
      if (run < 0) wrong += differing(texture, filled);
      if (run >= 0) times.push_back({seconds, seconds});
    }
    found[name] = times_json(times);
  };
  measure("levels",
          [&] { cuda::fill_atlas(device, texture.data(), side, kAtlasLevels, HoleFill::mean, coarser.data()); });
  measure("at_once", [&] { cuda::fill_atlas_at_once(device, texture.data(), side); });
  found["differing"] = wrong;
  return found;
}

}  // namespace lightcuts::app::study

#else

namespace lightcuts::app::study {

Json time_gpu_atlas(int, const std::vector<std::uint16_t>&, const std::vector<std::uint16_t>&, int, int) {
  throw Error(Code::not_built, "this build has no CUDA backend");
}

}  // namespace lightcuts::app::study

#endif
