#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

namespace lightcuts::bench {

/// Seconds that `work` takes.
template <class Work>
double seconds(Work work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Value at a fraction of the sorted list.
inline double quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

/// Runs reference and subject in turns; reports the subject's time as the benchmark's, and the median and quartiles of
/// ratio(seconds of reference, seconds of subject) as counters.
template <class Reference, class Subject, class Ratio>
void compare_in_turns(benchmark::State& state, const std::string& counter, Reference reference, Subject subject,
                      Ratio ratio) {
  std::vector<double> ratios;
  for (auto _ : state) {
    const double before = seconds(reference);
    const double time = seconds(subject);
    ratios.push_back(ratio(before, time));
    state.SetIterationTime(time);
  }
  state.counters[counter] = quantile(ratios, 0.5);
  state.counters[counter + "_low"] = quantile(ratios, 0.25);
  state.counters[counter + "_high"] = quantile(ratios, 0.75);
}

}  // namespace lightcuts::bench
