#include "bench.h"
#include "lightcuts/error.h"

namespace lightcuts::app {

BenchResult run_study(const BenchRequest&) {
  throw Error(Code::not_built, "the study is being built; what can be measured now: --stats of 'lightcuts render'");
}

}  // namespace lightcuts::app
