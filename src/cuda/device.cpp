#include "cuda/device.h"

#include <fmt/format.h>
#include <nvtx3/nvToolsExt.h>

#include <cstdlib>

#include "lightcuts/error.h"

namespace lightcuts::cuda {

void check(cudaError_t status, const char* doing) {
  if (status == cudaSuccess) return;
  const char* words = cudaGetErrorString(status);
  cudaGetLastError();  // a sticky "last error" would be blamed on the next call
  switch (status) {
    case cudaErrorMemoryAllocation:
      throw Error(Code::out_of_memory,
                  fmt::format("The GPU has no memory left while {}. Close other programs that use it, give a smaller "
                              "--memory, fewer --vpls or a smaller --ism-size, or use --backend cpu.",
                              doing));
    case cudaErrorNoDevice:
    case cudaErrorInvalidDevice:
    case cudaErrorDevicesUnavailable:
      throw Error(Code::no_device, fmt::format("No usable NVIDIA GPU while {}: {}. Use --backend cpu.", doing, words));
    case cudaErrorInsufficientDriver:
      throw Error(
          Code::no_device,
          fmt::format("The NVIDIA driver is missing, or too old for this build (made with CUDA {}.{}), while {}. "
                      "Install or update the driver, or use --backend cpu.",
                      CUDART_VERSION / 1000, CUDART_VERSION % 1000 / 10, doing));
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorInvalidDeviceFunction:
      throw Error(Code::no_device,
                  fmt::format("This build has no code for this GPU's architecture (while {}). Build with "
                              "LIGHTCUTS_CUDA_ARCHITECTURES set to it, or use --backend cpu.",
                              doing));
    default:
      throw Error(Code::no_device, fmt::format("The GPU failed while {}: {}. Use --backend cpu, and report this if "
                                               "another try fails too.",
                                               doing, words));
  }
}

Device::Device(int index, std::uint64_t memory_limit) {
  int count = 0;
  check(cudaGetDeviceCount(&count), "looking for GPUs");
  if (index < 0 || index >= count) {
    throw Error(Code::no_device,
                fmt::format("There is no GPU number {}: this machine has {}. Give --device 0 to {}, or --backend cpu.",
                            index, count, count - 1));
  }
  check(cudaSetDevice(index), "opening the GPU");
  cudaDeviceProp properties{};
  check(cudaGetDeviceProperties(&properties, index), "reading the GPU's properties");
  name_ = properties.name;
  multiprocessors_ = properties.multiProcessorCount;
  check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "making a stream");
  check(cudaMallocHost(reinterpret_cast<void**>(&mailbox_), kMailboxWords * sizeof(std::uint64_t)),
        "taking page-locked memory");

  // Freed memory stays with the pool until the program ends: stages run again and again.
  cudaMemPool_t pool = nullptr;
  check(cudaDeviceGetDefaultMemPool(&pool, index), "opening the memory pool");
  std::uint64_t keep = ~std::uint64_t{0};
  check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keep), "setting up the memory pool");

  std::size_t free_bytes = 0, total_bytes = 0;
  check(cudaMemGetInfo(&free_bytes, &total_bytes), "asking for free GPU memory");
  limit_ = memory_limit != 0 ? memory_limit : free_bytes / 4 * 3;
}

Device::~Device() {
  if (stream_ != nullptr) {
    cudaStreamSynchronize(stream_);
    cudaStreamDestroy(stream_);
  }
  if (mailbox_ != nullptr) cudaFreeHost(mailbox_);
}

namespace {

/// Bytes beyond which allocations fail as if the driver had no more, for tests: what was planned does not come true.
std::uint64_t tested_limit() {
  const char* const words = std::getenv("LIGHTCUTS_TEST_GPU_MEMORY");
  return words != nullptr ? std::strtoull(words, nullptr, 10) : ~std::uint64_t{0};
}

}  // namespace

void* Device::allocate(std::size_t bytes) {
  if (bytes == 0) return nullptr;
  if (used_ + bytes > limit_) {
    throw Error(Code::out_of_memory,
                fmt::format("This needs {:.1f} MB of GPU memory beside the {:.1f} MB in use; the limit is {:.1f} MB. "
                            "Give a larger --memory, fewer --vpls or a smaller --ism-size.",
                            static_cast<double>(bytes) / 1e6, static_cast<double>(used_) / 1e6,
                            static_cast<double>(limit_) / 1e6));
  }
  if (used_ + bytes > tested_limit()) check(cudaErrorMemoryAllocation, "taking GPU memory");
  void* pointer = nullptr;
  check(cudaMallocAsync(&pointer, bytes, stream_), "taking GPU memory");
  used_ += bytes;
  if (used_ > peak_) peak_ = used_;
  return pointer;
}

void Device::free(void* pointer, std::size_t bytes) noexcept {
  cudaFreeAsync(pointer, stream_);
  used_ -= bytes;
}

StageTimer::StageTimer(Device& device, const char* name) : device_(device) {
  nvtxRangePushA(name);
  check(cudaEventCreate(&begin_), "making a timer");
  check(cudaEventCreate(&end_), "making a timer");
  check(cudaEventRecord(begin_, device_.stream()), "starting a timer");
}

StageTimer::~StageTimer() {
  if (!stopped_) nvtxRangePop();
  cudaEventDestroy(begin_);
  cudaEventDestroy(end_);
}

void StageTimer::stop() {
  if (stopped_) return;
  stopped_ = true;
  nvtxRangePop();
  check(cudaEventRecord(end_, device_.stream()), "stopping a timer");
}

double StageTimer::ms() {
  stop();
  check(cudaEventSynchronize(end_), "waiting for a timer");
  float elapsed = 0;
  check(cudaEventElapsedTime(&elapsed, begin_, end_), "reading a timer");
  return elapsed;
}

void Device::synchronize() { check(cudaStreamSynchronize(stream_), "waiting for the GPU"); }

}  // namespace lightcuts::cuda
