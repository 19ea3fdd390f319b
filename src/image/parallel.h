#pragma once

#include <tbb/parallel_for.h>

#include <numeric>
#include <vector>

namespace lightcuts {

/// Calls fn(row) for every row, in parallel.
template <class Fn>
void for_each_row(int height, const Fn& fn) {
  tbb::parallel_for(0, height, [&](int y) { fn(y); });
}

/// Sum over rows of fn(row): rows in parallel, their sums added in order, so that threads do not change the result.
template <class Fn>
double sum_of_rows(int height, const Fn& fn) {
  std::vector<double> sums(static_cast<std::size_t>(height));
  for_each_row(height, [&](int y) { sums[static_cast<std::size_t>(y)] = fn(y); });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

}  // namespace lightcuts
