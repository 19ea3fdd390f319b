#pragma once

#include <nlohmann/json.hpp>
#include <vector>

namespace lightcuts::app::study {

using Json = nlohmann::ordered_json;

/// How long something took: by the clock, and summed over the processors that worked on it.
struct Time {
  double wall_s = 0, cpu_s = 0;
};

/// Measures from its making on.
class Stopwatch {
 public:
  Stopwatch();
  [[nodiscard]] Time elapsed() const;

 private:
  double wall_, cpu_;
};

/// {"wall_s", "low_s", "high_s", "cpu_s", "repeats"} of repeated measurements; wall_s and cpu_s are medians.
Json times_json(const std::vector<Time>& times);

/// As time_repeatedly, where `work` returns its own Time.
template <class Work>
Json times_of_repeated(int repeats, double limit_s, const Work& work) {
  std::vector<Time> times;
  const Stopwatch all;
  do {
    times.push_back(work());
  } while (static_cast<int>(times.size()) < repeats && all.elapsed().wall_s < limit_s);
  return times_json(times);
}

/// Does `work` up to `repeats` times, but no more once `limit_s` seconds have been spent; at least once.
template <class Work>
Json time_repeatedly(int repeats, double limit_s, const Work& work) {
  return times_of_repeated(repeats, limit_s, [&] {
    const Stopwatch one;
    work();
    return one.elapsed();
  });
}

/// Mean and standard deviation of a sample.
struct Spread {
  double mean = 0, deviation = 0;
};
Spread spread_of(const std::vector<double>& values);

/// Exponent p of y ~ x^p by least squares of the logarithms; 0 for less than two points.
double growth_exponent(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace lightcuts::app::study
