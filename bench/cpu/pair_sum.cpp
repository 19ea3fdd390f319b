// How close does the unshadowed sum over lights come to what the processor can compute?
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <stdexcept>
#include <vector>

#include "cpu/benchmarks.h"
#include "cpu/fma_loop.h"
#include "cpu/ratio.h"
#include "cpu/simd/isa.h"
#include "cpu/simd/shade_kernels.h"
#include "cpu_shade/random_packet.h"
#include "oracle/light_oracle.h"

namespace lightcuts::bench {
namespace {

/// What a pair costs in additions and multiplications, a reciprocal counting one: the customary count.
constexpr double kOperationsPerPair = 33;
constexpr std::size_t kLights = 256;  // a block of AllLights
constexpr int kRepeats = 500;

struct Case {
  Isa isa;
  ReceiverPacket receivers;
  std::vector<Vpl> vpls;
};

Case make_case(Isa isa, bool flat) {
  Dice dice(1);
  Case c{isa, random_receivers(dice, flat), {}};
  for (std::size_t i = 0; i < kLights; ++i) c.vpls.push_back(random_vpl(dice, 5));
  return c;
}

void check(const Case& c) {
  PacketSum sum{};
  shade_kernels(c.isa).sum_vpls(c.receivers, c.vpls.data(), c.vpls.size(), 1e-4f, sum);
  for (int lane = 0; lane < kPacketSize; ++lane) {
    double expected = 0;
    for (const Vpl& vpl : c.vpls) {
      expected +=
          vpl.intensity.x * oracle::vpl_factor(get_lane(c.receivers.position, lane), get_lane(c.receivers.ns, lane),
                                               get_lane(c.receivers.ng, lane), vpl.position, vpl.axis, 1e-2);
    }
    if (!(std::abs(sum.light.x[lane] - expected) <= 1e-5 * expected + 1e-7)) {
      throw std::runtime_error(
          fmt::format("pair sum by {}: {} instead of {}", isa_name(c.isa), sum.light.x[lane], expected));
    }
  }
}

void run(benchmark::State& state, const Case& c) {
  const ShadeKernels& kernels = shade_kernels(c.isa);
  double operations = 0;
  const auto reference = [&] { operations = run_fma_loop(c.isa, 200'000); };
  const auto subject = [&] {
    PacketSum sum{};
    for (int i = 0; i < kRepeats; ++i) {
      kernels.sum_vpls(c.receivers, c.vpls.data(), c.vpls.size(), 1e-4f, sum);
      benchmark::DoNotOptimize(sum);
    }
  };
  constexpr double pairs = static_cast<double>(kPacketSize) * kLights * kRepeats;
  compare_in_turns(state, "share_of_fma_loop", reference, subject,
                   [&](double fma, double sum) { return (pairs * kOperationsPerPair / sum) / (operations / fma); });
  state.counters["pairs"] = benchmark::Counter(pairs, benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace

void register_pair_sum() {
  for (const Isa isa : available_isas()) {
    for (const bool flat : {true, false}) {
      const Case c = make_case(isa, flat);
      check(c);
      const std::string name = fmt::format("pair_sum/{}/{}", isa_name(isa), flat ? "flat" : "bent_normals");
      benchmark::RegisterBenchmark(name.c_str(), [c](benchmark::State& state) { run(state, c); })
          ->UseManualTime()
          ->Unit(benchmark::kMillisecond);
    }
  }
}

}  // namespace lightcuts::bench
