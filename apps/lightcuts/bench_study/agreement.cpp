#include "bench_study/agreement.h"

#include <fmt/format.h>

#include <optional>

#include "bench_study/rooms.h"

namespace lightcuts::app::study {
namespace {

/// Largest error of a cut that passes: its nodes are each bounded to 2 % of the pixel, together they are off by about that.
constexpr double kMostCutError = 0.05;

/// Pixels a side.
std::optional<int> check_side(Study& study, std::uint64_t lights, Visibility visibility) {
  constexpr double kMapsASecond = 1e4;
  if (study.on_cpu() && visibility == Visibility::ism &&
      static_cast<double>(lights) > kMapsASecond * study.request().budget_s) {
    return std::nullopt;
  }
  if (!study.on_cpu()) return 32;  // a pixel is a thread there, so that few of them take as long
  return lights > 20000 ? 8 : lights > 3000 ? 16 : 32;
}

}  // namespace

Json compare_cut(Study& study, std::uint64_t lights, const ShadeOptions& options) {
  const std::optional<int> side = check_side(study, lights, options.visibility);
  if (!side) return nullptr;
  const auto shade = [&](const ShadeOptions& wanted) {
    Statistics unused;
    return study.shade(study_room().cameras[0], *side, wanted, unused);
  };
  const Image all = shade(shade_options(Method::instant_radiosity, options.visibility)), cut = shade(options);
  const double error = mean_error(cut, all);
  bool nearer = false;
  if (error > kMostCutError && options.visibility == Visibility::ism) {
    const Image rays = shade(shade_options(Method::instant_radiosity, Visibility::rays));
    nearer = mean_error(cut, rays) < mean_error(all, rays);
  }
  return {{"error", error}, {"nearer", nearer}};
}

void check_cut(Study& study, const std::string& what, const Json& compared) {
  if (compared.is_null()) return;
  const double error = compared["error"];
  const bool nearer = compared["nearer"];
  study.check(what + ": error against all lights", error <= kMostCutError || nearer,
              fmt::format("{:.2f} % (at most {:.0f} %{})", 100 * error, 100 * kMostCutError,
                          nearer ? ", or nearer to shadow rays than all lights by maps: it is" : ""));
}

}  // namespace lightcuts::app::study
