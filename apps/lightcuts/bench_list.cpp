#include "bench.h"

namespace lightcuts::app {

const std::vector<Benchmark>& benchmarks() {
  static const std::vector<Benchmark> all{
      {"study", "the tables and figures of the study, measured here, beside its own", run_study},
      {"frame", "time of each stage of a frame by number of lights, beside what it should be", run_frame},
  };
  return all;
}

}  // namespace lightcuts::app
