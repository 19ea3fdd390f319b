#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>

#include "lightcuts/render.h"

namespace lightcuts {

/// Lets many threads report to one callback, a few times a second, and hear whether to go on.
class Progress {
 public:
  /// `total` is the amount of work at which `done` is 1; `callback` may be empty and must outlive this.
  Progress(const ProgressFn& callback, const char* stage, double total)
      : callback_(callback), stage_(stage), total_(total) {}

  /// Adds work done. Returns false once the callback has asked to stop.
  bool advance(double amount) {
    done_.fetch_add(amount, std::memory_order_relaxed);
    if (callback_ && !stopped()) report();
    return !stopped();
  }
  [[nodiscard]] bool stopped() const { return stopped_.load(std::memory_order_relaxed); }

 private:
  using Clock = std::chrono::steady_clock;

  /// Whoever finds another thread reporting goes on with its work.
  void report() {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock.owns_lock() || Clock::now() < next_) return;
    if (!callback_(stage_, std::min(1.0, done_.load(std::memory_order_relaxed) / total_))) stopped_ = true;
    next_ = Clock::now() + std::chrono::milliseconds(50);
  }

  const ProgressFn& callback_;
  const char* stage_;
  double total_;
  std::atomic<double> done_{0};
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
  Clock::time_point next_{};
};

}  // namespace lightcuts
