#include "bench_frame/frame_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "console.h"
#include "lightcuts/error.h"

namespace lightcuts::app::frame {
namespace {

constexpr float kMinDistance = 0.0133f;  ///< fraction of the scene's diagonal, as the goals say
constexpr int kWarmUp = 2;
constexpr const char* kLine = "{:<12} {:>8} {:<26} {:>10} {:>18} {:>17}  {}";

/// What a picture's row has beside its time.
Json picture_json(const Statistics& s, double ms) {
  Json row{{"cut_mean", s.cut.mean},
           {"pairs", s.pairs},
           {"rays", s.rays},
           {"lights_used", s.cut.lights_used},
           {"shadow_maps", s.shadow_maps.count},
           {"rounds", s.shadow_maps.rounds},
           {"device_peak_bytes", s.memory_bytes.device_peak},
           {"pairs_per_s", 1e3 * static_cast<double>(s.pairs) / ms}};
  if (s.rays > 0) row["rays_per_s"] = 1e3 * static_cast<double>(s.rays) / ms;
  return row;
}

std::string picture_words(const Statistics& s, double ms) {
  std::string words;
  if (s.cut.mean > 0) words += fmt::format("cut {:.0f}, {} lights, ", s.cut.mean, s.cut.lights_used);
  words += fmt::format("{:.2f} T pairs/s", static_cast<double>(s.pairs) / ms / 1e9);
  if (s.rays > 0) words += fmt::format(", {:.2f} G rays/s", static_cast<double>(s.rays) / ms / 1e6);
  if (s.shadow_maps.count > 0)
    words += fmt::format(", {} maps in {} rounds", s.shadow_maps.count, s.shadow_maps.rounds);
  return words + fmt::format(", peak {:.0f} MB", static_cast<double>(s.memory_bytes.device_peak) / 1e6);
}

}  // namespace

FrameBench::FrameBench(const BenchRequest& request)
    : request_(request), parts_(request.parts), sizes_(sizes_of(request.scale)), backend_(make_bench_backend(request)) {
  result_.json["machine"] = machine_json(backend_->device_name());
  result_.json["side_px"] = sizes_.side;
  result_.json["min_distance"] = kMinDistance;
  result_.json["rows"] = Json::array();
  print_result(fmt::format("{}, {}x{} pixels, error 0.02, min-distance {}", backend_->device_name(), sizes_.side,
                           sizes_.side, kMinDistance));
  print_result(
      fmt::format(kLine, "scene", "VPLs", "stage", "median ms", "lowest..highest", "goal", "what was counted"));
}

bool FrameBench::stopped() {
  if (Interruption::requested()) result_.complete = false;
  return !result_.complete;
}

bool FrameBench::is_measured(const std::string& stage) const {
  const Json& rows = result_.json["rows"];
  return std::any_of(rows.begin(), rows.end(), [&](const Json& row) {
    return row["scene"] == name_ && row["vpls"] == vpls_ && row["stage"] == stage;
  });
}

ShadeOptions FrameBench::options(Method method, Visibility visibility) {
  ShadeOptions o;
  o.method = method;
  o.visibility = visibility;
  o.min_distance = kMinDistance;
  o.ism_size = 32;
  o.ism_points = 2000;
  return o;
}

void FrameBench::use(std::uint64_t vpls) {
  vpls_ = vpls;
  has_lights_ = false;
}

void FrameBench::make_lights() {
  if (has_lights_) return;
  trace(*backend_, vpls_);
  backend_->build_light_tree({}, {});
  has_lights_ = true;
}

void FrameBench::trace(Backend& backend, std::uint64_t vpls, int bounces) {
  VplOptions o;
  o.count = vpls;
  o.bounces = bounces;
  backend.trace_vpls(o, {});
}

void FrameBench::time_vpls(const std::string& stage, int bounces) {
  if (!wants(stage)) return;
  has_lights_ = false;
  const Repeats times = time(effort(), [&] {
    trace(*backend_, vpls_, bounces);
    return backend_->stage_times().vpls;
  });
  add_row(stage, times, Json::object(), "");
}

void FrameBench::time_tree() {
  if (!wants("light tree") || is_measured("light tree")) return;
  make_lights();
  const Repeats times = time(effort(), [&] {
    backend_->build_light_tree({}, {});
    return backend_->stage_times().tree;
  });
  add_row("light tree", times, Json::object(), "");
}

double FrameBench::picture_ms(const ShadeOptions& o, Again again, Statistics& statistics) {
  statistics = {};
  if (again != Again::pixels) backend_->forget_maps();
  if (again == Again::everything) {
    trace(*backend_, vpls_);
    backend_->build_light_tree({}, {});
  }
  backend_->shade(camera_, sizes_.side, sizes_.side, o, 0, statistics, {});
  const StageTimes t = backend_->stage_times();
  if (again == Again::everything) return t.vpls + t.tree + t.points + t.shade;
  return again == Again::maps ? t.points + t.light : t.light;
}

void FrameBench::shade(const std::string& stage, const ShadeOptions& o, Again again) {
  if (!wants(stage) || is_measured(stage)) return;
  make_lights();
  try {
    Statistics s;
    const Repeats times = time(effort(), [&] { return picture_ms(o, again, s); });
    if (times.count > 0) add_row(stage, times, picture_json(s, times.median), picture_words(s, times.median));
  } catch (const Error& error) {
    if (error.code() != Code::not_built) throw;
    print_result(fmt::format(kLine, name_, vpls_, stage, "-", "", "", "not part of this backend yet"));
  }
}

Repeats FrameBench::time(const Effort& effort, const std::function<double()>& run) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> times;
  const auto start = Clock::now();
  for (int k = -kWarmUp; k < effort.runs && !stopped(); ++k) {
    const auto before = Clock::now();
    const double device = run();
    const double wall = std::chrono::duration<double, std::milli>(Clock::now() - before).count();
    if (k >= 0 || effort.runs == 1) times.push_back(device > 0 ? device : wall);
    const double spent = std::chrono::duration<double>(Clock::now() - start).count();
    if (spent > effort.longest_s && !times.empty()) break;
  }
  return summarise(times);
}

void FrameBench::add_row(const std::string& stage, const Repeats& r, const Json& more, const std::string& counted) {
  if (r.count == 0) return;
  const Goal* const goal = goal_of(name_, stage, vpls_);
  const std::string asked = goal == nullptr ? "-" : goal_words(*goal);
  Json row{{"scene", name_},  {"vpls", vpls_},     {"stage", stage}, {"median_ms", r.median},
           {"low_ms", r.low}, {"high_ms", r.high}, {"runs", r.count}};
  if (goal != nullptr) row["goal"] = asked;
  row.update(more);
  result_.json["rows"].push_back(std::move(row));
  const std::string lights = vpls_ == 0 ? "-" : fmt::format("{}", vpls_);
  print_result(fmt::format(kLine, name_, lights, stage, fmt::format("{:.3f}", r.median),
                           fmt::format("{:.3f}..{:.3f}", r.low, r.high), asked, counted));
}

void FrameBench::print_goals() {
  const bool full_scale = sizes_.side == kGoalSide;
  result_.json["goals"] = goals_json(result_.json["rows"], full_scale);
  print_result("");
  for (const std::string& line : goals_table(result_.json["goals"])) print_result(line);
  if (!full_scale) {
    print_result(fmt::format("The goals are of {0}x{0} pixels, so nothing is met or missed at {1}x{1}.", kGoalSide,
                             sizes_.side));
  }
}

}  // namespace lightcuts::app::frame
