#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

namespace lightcuts {

/// Memory that is all zeros, handed out by the system in large pages when it is first touched: by whichever threads work
/// on it, not by the one that makes it. Faults of small pages cost a frame of a million pixels more than its light.
template <class T>
class ZeroedArray {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>, "zero bytes must be a value");

 public:
  /// Throws std::bad_alloc.
  explicit ZeroedArray(std::size_t size) : size_(size), bytes_(size * sizeof(T) + kLargePage) {
    mapped_ = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (mapped_ == MAP_FAILED) throw std::bad_alloc();
    void* aligned = mapped_;
    std::size_t left = bytes_;
    std::align(kLargePage, size * sizeof(T), aligned, left);
    values_ = static_cast<T*>(aligned);
#if defined(MADV_HUGEPAGE)
    madvise(aligned, left, MADV_HUGEPAGE);  // a wish: small pages do too
#endif
  }
  ~ZeroedArray() { munmap(mapped_, bytes_); }
  ZeroedArray(const ZeroedArray&) = delete;
  ZeroedArray& operator=(const ZeroedArray&) = delete;

  [[nodiscard]] std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return values_[i]; }
  const T& operator[](std::size_t i) const { return values_[i]; }

 private:
  static constexpr std::size_t kLargePage = std::size_t{2} << 20;

  std::size_t size_, bytes_;
  void* mapped_ = nullptr;
  T* values_ = nullptr;
};

}  // namespace lightcuts
