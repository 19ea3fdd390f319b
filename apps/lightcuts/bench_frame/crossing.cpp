// From how many lights on cuts beat the sum over all lights, by maps.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench_frame/frame_bench.h"

namespace lightcuts::app::frame {
namespace {

constexpr double kFewest = 64;
constexpr int kSteps = 8;  ///< of bisection: to 2 % of the number

}  // namespace

void FrameBench::measure_crossing(const std::string& stage, Again again) {
  if (!wants(stage) || !parts_.numbers().empty()) return;  // it has no number of lights of its own
  const Effort few{std::min(5, sizes_.runs), 0.25 * sizes_.longest_s};
  const auto timed = [&](Method method) {
    Statistics s;
    return time(few, [&] { return picture_ms(options(method, Visibility::ism), again, s); });
  };
  std::uint64_t fewer = static_cast<std::uint64_t>(kFewest), tried = 0, crossing = 0;
  std::uint64_t more = sizes_.most_crossing;
  Repeats cut, all;
  for (int step = 0; step < kSteps && fewer + 1 < more; ++step) {
    use(static_cast<std::uint64_t>(std::lround(std::sqrt(static_cast<double>(fewer) * static_cast<double>(more)))));
    make_lights();
    const Repeats cut_here = timed(Method::lightcuts), all_here = timed(Method::instant_radiosity);
    if (stopped()) return;
    const bool wins = cut_here.median < all_here.median;
    (wins ? more : fewer) = vpls_;
    tried = std::max(tried, vpls_);
    if (wins) crossing = vpls_;
    if (wins || crossing == 0) cut = cut_here, all = all_here;
  }
  vpls_ = crossing > 0 ? crossing : tried;
  add_row(
      stage, cut, {{"all_lights_ms", all.median}, {"crossed", crossing > 0}},
      fmt::format("all lights {:.3f} ms{}", all.median, crossing > 0 ? "" : ": cuts were not faster at any number"));
}

}  // namespace lightcuts::app::frame
