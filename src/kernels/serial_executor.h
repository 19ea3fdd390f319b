#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace lightcuts {

/// Runs the algorithms that are written over an executor on one CPU thread: how CI checks the text that CUDA runs.
///
/// An executor offers allocate<T>(n) (data(), size(), movable), for_each(n, f) calling f(i) for every i in any order,
/// exclusive_scan (returns the total), sort_pairs and sort_words (stable), and copies from and to the host.
class SerialExecutor {
 public:
  template <class T>
  using Buffer = std::vector<T>;

  template <class T>
  Buffer<T> allocate(std::size_t n) {
    return Buffer<T>(n);
  }

  template <class T>
  Buffer<T> upload(const T* values, std::size_t n) {
    return Buffer<T>(values, values + n);
  }

  /// One value from the executor's memory.
  template <class T>
  T fetch(const T* value) {
    return *value;
  }

  template <class F>
  void for_each(std::uint32_t n, const F& f) {
    for (std::uint32_t i = 0; i < n; ++i) f(i);
  }

  template <class T>
  T exclusive_scan(const T* in, T* out, std::uint32_t n) {
    if (n == 0) return T{};
    const T last = in[n - 1];
    std::exclusive_scan(in, in + n, out, T{});
    return out[n - 1] + last;
  }

  /// Sorts words by their bits from `begin` to before `end`; equal ones keep their order.
  void sort_words(Buffer<std::uint64_t>& words, int begin, int end) {
    const std::uint64_t mask = end - begin == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << (end - begin)) - 1;
    std::stable_sort(words.begin(), words.end(),
                     [&](std::uint64_t a, std::uint64_t b) { return (a >> begin & mask) < (b >> begin & mask); });
  }

  /// Sorts values by their keys; equal keys keep their order.
  void sort_pairs(Buffer<std::uint64_t>& keys, Buffer<std::uint32_t>& values) {
    std::vector<std::uint32_t> order(keys.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    Buffer<std::uint64_t> sorted_keys(keys.size());
    Buffer<std::uint32_t> sorted_values(keys.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      sorted_keys[i] = keys[order[i]];
      sorted_values[i] = values[order[i]];
    }
    keys = std::move(sorted_keys);
    values = std::move(sorted_values);
  }
};

}  // namespace lightcuts
