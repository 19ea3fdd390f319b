#include "bench_study/series.h"

#include <algorithm>
#include <cmath>

namespace lightcuts::app::study {

void Series::add(double lights, double seconds) {
  lights_.push_back(lights);
  seconds_.push_back(seconds);
}

double Series::expected(double lights) const {
  if (lights_.empty()) return 0;
  const double factor = lights / lights_.back();
  if (lights_.size() < 2) return seconds_.back() * factor;
  const std::size_t last = lights_.size() - 1;
  const double growth = std::log(seconds_[last] / seconds_[last - 1]) / std::log(lights_[last] / lights_[last - 1]);
  return seconds_.back() * std::pow(factor, std::clamp(growth, 0.0, 1.0));
}

std::optional<double> Series::at(double lights) const {
  const auto found = std::find(lights_.begin(), lights_.end(), lights);
  if (found == lights_.end()) return std::nullopt;
  return seconds_[static_cast<std::size_t>(found - lights_.begin())];
}

std::optional<double> crossing(const Series& slow, const Series& fast) {
  std::optional<double> at;
  double last_x = 0, last_gap = 0;
  for (std::size_t i = 0; i < slow.lights().size(); ++i) {
    const double x = slow.lights()[i];
    const std::optional<double> other = fast.at(x);
    if (!other) continue;
    const double gap = std::log(slow.seconds()[i] / *other);
    if (gap < 0) {
      at.reset();
    } else if (!at) {
      const double share = last_x > 0 ? last_gap / (last_gap - gap) : 1;
      at = last_x > 0 ? last_x * std::pow(x / last_x, share) : x;
    }
    last_x = x;
    last_gap = gap;
  }
  return at;
}

}  // namespace lightcuts::app::study
