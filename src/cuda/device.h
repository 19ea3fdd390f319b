#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace lightcuts::cuda {

/// Turns a failed CUDA call into an Error: no_device or out_of_memory, with a sentence that helps.
/// `doing` completes "while ...".
void check(cudaError_t status, const char* doing);

/// One GPU, its stream and its memory account.
///
/// Memory comes from the device's stream-ordered pool: what a stage frees the next one gets without a system call.
/// A limit keeps every allocation inside the plan; passing it is Error{out_of_memory} before the driver is asked.
class Device {
 public:
  /// Opens device `index`. Throws Error{no_device} where there is none, or it does not answer, or this build
  /// has no code for it. `memory_limit` 0: three quarters of what is free now.
  Device(int index, std::uint64_t memory_limit);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] cudaStream_t stream() const noexcept { return stream_; }
  [[nodiscard]] int multiprocessors() const noexcept { return multiprocessors_; }
  [[nodiscard]] std::uint64_t used() const noexcept { return used_; }
  [[nodiscard]] std::uint64_t peak() const noexcept { return peak_; }
  [[nodiscard]] std::uint64_t limit() const noexcept { return limit_; }
  void set_limit(std::uint64_t bytes) noexcept { limit_ = bytes; }
  void reset_peak() noexcept { peak_ = used_; }

  void* allocate(std::size_t bytes);
  void free(void* pointer, std::size_t bytes) noexcept;
  void synchronize();

  /// Page-locked words that small results come back through; the caller synchronizes.
  [[nodiscard]] std::uint64_t* mailbox() const noexcept { return mailbox_; }
  static constexpr std::size_t kMailboxWords = 64;

 private:
  std::string name_;
  int multiprocessors_ = 0;
  cudaStream_t stream_ = nullptr;
  std::uint64_t* mailbox_ = nullptr;
  std::uint64_t used_ = 0, peak_ = 0, limit_ = 0;
};

/// Array in a device's memory. Holds whatever was there before: fill it before reading.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(Device& device, std::size_t size)
      : device_(&device), data_(static_cast<T*>(device.allocate(size * sizeof(T)))), size_(size) {}
  DeviceBuffer(DeviceBuffer&& other) noexcept
      : device_(other.device_), data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~DeviceBuffer() {
    if (data_ != nullptr) device_->free(data_, size_ * sizeof(T));
  }

  [[nodiscard]] T* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return size_ * sizeof(T); }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }

  void upload(const T* values, std::size_t count) {
    if (count != 0) {
      check(cudaMemcpyAsync(data_, values, count * sizeof(T), cudaMemcpyHostToDevice, device_->stream()),
            "sending data");
    }
  }
  /// Waits until the values have arrived.
  void download(T* values, std::size_t count, std::size_t first = 0) const {
    if (count == 0) return;
    check(cudaMemcpyAsync(values, data_ + first, count * sizeof(T), cudaMemcpyDeviceToHost, device_->stream()),
          "fetching data");
    device_->synchronize();
  }
  void fill_bytes(int value) {
    if (size_ != 0) check(cudaMemsetAsync(data_, value, size_ * sizeof(T), device_->stream()), "filling memory");
  }

 private:
  Device* device_ = nullptr;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// A stage's time on the device, and its name in a profiler's time line (NVTX).
class StageTimer {
 public:
  StageTimer(Device& device, const char* name);
  ~StageTimer();
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

  /// Marks the end; the first call counts.
  void stop();
  /// From the beginning to the end [ms]; waits for the device.
  [[nodiscard]] double ms();

 private:
  Device& device_;
  cudaEvent_t begin_ = nullptr, end_ = nullptr;
  bool stopped_ = false;
};

}  // namespace lightcuts::cuda
