#pragma once

#include <optional>
#include <vector>

namespace lightcuts::app::study {

/// Times over a growing number of lights.
class Series {
 public:
  void add(double lights, double seconds);

  /// What the next point will take, from how the last two grew: at most linear in the lights; 0 before the
  /// first.
  [[nodiscard]] double expected(double lights) const;

  /// Seconds at this number of lights, if it was measured.
  [[nodiscard]] std::optional<double> at(double lights) const;
  [[nodiscard]] const std::vector<double>& lights() const { return lights_; }
  [[nodiscard]] const std::vector<double>& seconds() const { return seconds_; }

 private:
  std::vector<double> lights_, seconds_;
};

/// Number of lights from which on `fast` takes less time than `slow` and keeps to it, interpolated between logarithms;
/// nullopt if it does not where both were measured last. The smallest number measured if it always does.
std::optional<double> crossing(const Series& slow, const Series& fast);

}  // namespace lightcuts::app::study
