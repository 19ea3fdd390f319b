#pragma once

#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "cuda/device.h"

namespace lightcuts::cuda {

inline constexpr int kBlockThreads = 256;

template <class F>
__global__ void __launch_bounds__(kBlockThreads) for_each_kernel(std::uint32_t n, F f) {
  const std::uint32_t i = blockIdx.x * kBlockThreads + threadIdx.x;
  if (i < n) f(i);
}

/// Runs the algorithms that are written over an executor (see kernels/serial_executor.h) on a GPU's stream.
class CudaExecutor {
 public:
  template <class T>
  using Buffer = DeviceBuffer<T>;

  explicit CudaExecutor(Device& device) : device_(&device) {}
  [[nodiscard]] Device& device() const noexcept { return *device_; }

  template <class T>
  Buffer<T> allocate(std::size_t n) {
    return Buffer<T>(*device_, n);
  }

  template <class T>
  Buffer<T> upload(const T* values, std::size_t n) {
    Buffer<T> buffer(*device_, n);
    buffer.upload(values, n);
    return buffer;
  }

  /// One value from the device's memory; waits for the stream.
  template <class T>
  T fetch(const T* value) {
    static_assert(sizeof(T) <= Device::kMailboxWords * sizeof(std::uint64_t));
    check(cudaMemcpyAsync(device_->mailbox(), value, sizeof(T), cudaMemcpyDeviceToHost, device_->stream()),
          "fetching a value");
    device_->synchronize();
    return *reinterpret_cast<const T*>(device_->mailbox());
  }

  template <class F>
  void for_each(std::uint32_t n, const F& f) {
    if (n == 0) return;
    for_each_kernel<<<(n + kBlockThreads - 1) / kBlockThreads, kBlockThreads, 0, device_->stream()>>>(n, f);
    check(cudaGetLastError(), "starting a kernel");
  }

  /// Prefix sum; returns the total, which waits for the stream.
  template <class T>
  T exclusive_scan(const T* in, T* out, std::uint32_t n) {
    static_assert(sizeof(T) <= sizeof(std::uint64_t));
    if (n == 0) return T{};
    std::size_t bytes = 0;
    check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, in, out, n, device_->stream()), "planning a prefix sum");
    DeviceBuffer<std::uint8_t> scratch(*device_, bytes);
    check(cub::DeviceScan::ExclusiveSum(scratch.data(), bytes, in, out, n, device_->stream()), "running a prefix sum");
    T* last = reinterpret_cast<T*>(device_->mailbox());
    check(cudaMemcpyAsync(last, in + n - 1, sizeof(T), cudaMemcpyDeviceToHost, device_->stream()), "fetching a total");
    check(cudaMemcpyAsync(last + 1, out + n - 1, sizeof(T), cudaMemcpyDeviceToHost, device_->stream()),
          "fetching a total");
    device_->synchronize();
    return last[0] + last[1];
  }

  /// Sorts values by their keys; equal keys keep their order.
  void sort_pairs(Buffer<std::uint64_t>& keys, Buffer<std::uint32_t>& values, int key_bits = 64) {
    Buffer<std::uint64_t> other_keys(*device_, keys.size());
    Buffer<std::uint32_t> other_values(*device_, values.size());
    cub::DoubleBuffer<std::uint64_t> key_pair(keys.data(), other_keys.data());
    cub::DoubleBuffer<std::uint32_t> value_pair(values.data(), other_values.data());
    std::size_t bytes = 0;
    check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, key_pair, value_pair, keys.size(), 0, key_bits,
                                          device_->stream()),
          "planning a sort");
    DeviceBuffer<std::uint8_t> scratch(*device_, bytes);
    check(cub::DeviceRadixSort::SortPairs(scratch.data(), bytes, key_pair, value_pair, keys.size(), 0, key_bits,
                                          device_->stream()),
          "sorting");
    if (key_pair.Current() != keys.data()) std::swap(keys, other_keys);
    if (value_pair.Current() != values.data()) std::swap(values, other_values);
  }

 private:
  Device* device_;
};

}  // namespace lightcuts::cuda
