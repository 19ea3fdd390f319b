#include "bench_study/measure.h"

#include <sys/resource.h>

#include <chrono>
#include <cmath>

#include "bench.h"

namespace lightcuts::app::study {
namespace {

double wall_now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double cpu_now() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

Stopwatch::Stopwatch() : wall_(wall_now()), cpu_(cpu_now()) {}
Time Stopwatch::elapsed() const { return {wall_now() - wall_, cpu_now() - cpu_}; }

Json times_json(const std::vector<Time>& times) {
  std::vector<double> walls, cpus;
  for (const Time& t : times) {
    walls.push_back(t.wall_s);
    cpus.push_back(t.cpu_s);
  }
  const Repeats wall = summarise(walls), cpu = summarise(cpus);
  return {{"wall_s", wall.median},
          {"low_s", wall.low},
          {"high_s", wall.high},
          {"cpu_s", cpu.median},
          {"repeats", wall.count}};
}

Spread spread_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  if (values.empty()) return {};
  double sum = 0, squares = 0;
  for (const double v : values) sum += v;
  const double mean = sum / n;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {mean, n > 1 ? std::sqrt(squares / (n - 1)) : 0};
}

double growth_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, n = 0;
  for (std::size_t i = 0; i < x.size() && i < y.size(); ++i) {
    if (!(x[i] > 0) || !(y[i] > 0)) continue;
    const double lx = std::log(x[i]), ly = std::log(y[i]);
    sx += lx;
    sy += ly;
    sxx += lx * lx;
    sxy += lx * ly;
    n += 1;
  }
  const double spread = n * sxx - sx * sx;
  return n < 2 || spread <= 0 ? 0 : (n * sxy - sx * sy) / spread;
}

}  // namespace lightcuts::app::study
