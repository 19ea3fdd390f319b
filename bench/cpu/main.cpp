// bench_cpu: the CPU's inner loops against what the machine can do.
//
//   bench_cpu [--benchmark_filter=REGEX] [--benchmark_out=FILE.json --benchmark_out_format=json]
//
// Both sides of a ratio run in turns within one benchmark, slice by slice, so that other load on the machine meets both;
// a ratio is the median over the slices, `_low` and `_high` its quartiles.
#include <benchmark/benchmark.h>

#include <exception>
#include <iostream>

#include "cpu/benchmarks.h"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    lightcuts::bench::register_pair_sum();
    lightcuts::bench::register_shadow_rays();
    lightcuts::bench::register_threads();
  } catch (const std::exception& error) {
    std::cerr << "not timed, because the result is wrong: " << error.what() << "\n";
    return 1;
  }
  benchmark::RunSpecifiedBenchmarks();
}
