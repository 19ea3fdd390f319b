// Are two threads twice as fast as one?
#include <benchmark/benchmark.h>
#include <tbb/info.h>

#include <memory>
#include <stdexcept>

#include "backend/backend.h"
#include "cpu/benchmarks.h"
#include "cpu/ratio.h"

namespace lightcuts::bench {
namespace {

struct Case {
  Scene scene = make_builtin_scene("study");
  Camera camera = select_camera(scene, "");
  std::unique_ptr<Backend> one = make_cpu_backend(1), two = make_cpu_backend(2);

  Case() {
    VplOptions options;
    options.count = 200;
    for (Backend* backend : {one.get(), two.get()}) {
      backend->set_scene(scene, {});
      backend->trace_vpls(options, {});
    }
  }
  Image shade(Backend& backend) const {
    Statistics statistics;
    return backend.shade(camera, 128, 128, {}, 0, statistics, {}).image;
  }
};

}  // namespace

void register_threads() {
  if (tbb::info::default_concurrency() < 2) return;
  static const Case c;
  if (find_channel(c.shade(*c.one), "R")->values != find_channel(c.shade(*c.two), "R")->values) {
    throw std::runtime_error("two threads give another picture than one");
  }
  benchmark::RegisterBenchmark("threads/two_over_one",
                               [](benchmark::State& state) {
                                 compare_in_turns(
                                     state, "speedup", [&] { c.shade(*c.one); }, [&] { c.shade(*c.two); },
                                     [](double one, double two) { return one / two; });
                               })
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->MinTime(2);
}

}  // namespace lightcuts::bench
