#include "backend/vpl_plan.h"

#include <algorithm>
#include <cmath>

#include "lightcuts/error.h"

namespace lightcuts {

VplShares share_by_power(std::uint64_t n, double area, double punctual, double sky) {
  const double total = area + punctual + sky;
  const auto part = [&](double power) -> std::uint64_t {
    if (!(power > 0)) return 0;
    return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(static_cast<double>(n) * power / total)));
  };
  return {part(area), part(punctual), part(sky)};
}

std::uint64_t pilot_path_count(std::uint64_t wanted) { return std::clamp<std::uint64_t>(2 * wanted, 2048, 32768); }

VplPilot make_pilot(std::uint64_t paths, double sum, double sum_sq) {
  const auto n = static_cast<double>(paths);
  const double yield = sum / n;
  return {n, yield, yield > 0 ? std::sqrt(std::max(sum_sq / n - yield * yield, 0.0)) / yield : 0.0};
}

std::uint64_t paths_for(std::uint64_t wanted, const VplPilot& flown) {
  const auto n = static_cast<double>(std::max<std::uint64_t>(wanted, 1));
  const double most = 64 * n + 1;
  double paths = flown.yield > 0 ? n / flown.yield : most;
  const double deviation = flown.spread * std::sqrt(1 / std::max(paths, 1.0) + 1 / flown.paths);
  paths *= 1 + std::max(0.0, 3 * deviation - 0.04);
  return static_cast<std::uint64_t>(std::clamp(std::round(std::min(paths, most)), 1.0, 4294967295.0));
}

bool needs_thinning(std::uint64_t made, std::uint64_t wanted) {
  return static_cast<double>(made) > 1.04 * static_cast<double>(wanted);
}

void check_vpl_options(const VplOptions& o) {
  const bool study_layout = o.primary_lights > 0 && o.vpls_per_light > 0;
  if ((o.primary_lights > 0) != (o.vpls_per_light > 0)) {
    throw Error(Code::invalid_argument, "primary lights and VPLs per light are set together or not at all");
  }
  if (!study_layout && o.count == 0) throw Error(Code::invalid_argument, "at least one VPL must be asked for");
  if (study_layout && o.primary_lights > 0xffffffffu / o.vpls_per_light) {
    throw Error(Code::invalid_argument, "at most 4294967295 light paths can be traced: ask for fewer VPLs per light");
  }
  if (o.placement == VplPlacement::camera && study_layout) {
    throw Error(Code::invalid_argument,
                "the study's layout (primary lights, VPLs per light) fixes where VPLs are; it cannot be placed for the "
                "camera");
  }
  if (o.placement == VplPlacement::camera && !(o.view && o.view->width > 0 && o.view->height > 0)) {
    throw Error(Code::invalid_argument, "to place VPLs for the camera its view must be given");
  }
  if (o.count > 0xffffffffu) throw Error(Code::invalid_argument, "at most 4294967295 VPLs can be asked for");
  if (o.bounces < 0) throw Error(Code::invalid_argument, "the number of bounces must not be negative");
  if (o.deposit == Deposit::study && !(o.deposit_distance > 0 && std::isfinite(o.deposit_distance))) {
    throw Error(Code::invalid_argument, "the study's deposit needs a reference distance above 0");
  }
}

}  // namespace lightcuts
