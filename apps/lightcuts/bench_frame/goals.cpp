#include "bench_frame/goals.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace lightcuts::app::frame {
namespace {

constexpr std::uint64_t kMillion = 1048576;
constexpr const char* kScenes[] = {"study", "veach-ajar"};

struct Reading {
  const char* name;
  const char* figure;  ///< of a row
  double scale;        ///< one unit in what the figure is in
  bool larger_is_better;
};

Reading reading(Unit unit) {
  switch (unit) {
    case Unit::pairs_per_second:
      return {"T/s", "pairs_per_s", 1e12, true};
    case Unit::rays_per_second:
      return {"G/s", "rays_per_s", 1e9, true};
    case Unit::lights:
      return {"lights", "vpls", 1, false};
    case Unit::milliseconds:
      break;
  }
  return {"ms", "median_ms", 1, false};
}

bool is_for(const Goal& goal, const std::string& scene) { return *goal.scene == 0 || scene == goal.scene; }

bool is_measured_by(const Goal& goal, const std::string& stage, std::uint64_t vpls) {
  const bool named =
      std::any_of(goal.stages.begin(), goal.stages.end(), [&](const char* name) { return stage == name; });
  return named && (goal.vpls == 0 || goal.vpls == vpls);
}

bool reaches(double value, double asked, const Reading& r) {
  return r.larger_is_better ? value >= asked : value <= asked;
}

/// The row of a scene that comes nearest to the goal; null where none was measured.
const Json* best_row(const Goal& goal, const std::string& scene, const Json& rows) {
  const Reading r = reading(goal.unit);
  const Json* best = nullptr;
  for (const Json& row : rows) {
    if (row["scene"] != scene || !row.contains(r.figure) || !is_measured_by(goal, row["stage"], row["vpls"])) continue;
    if (best == nullptr || reaches(row[r.figure], (*best)[r.figure], r)) best = &row;
  }
  return best;
}

Json measured_json(const Goal& goal, const Json& row, bool full_scale) {
  const Reading r = reading(goal.unit);
  const double value = row[r.figure].get<double>() / r.scale;
  // Where cuts never were faster, the number is the largest that was tried.
  const bool reached = row.value("crossed", true);
  Json measured{{"value", value}};
  if (!reached) measured["or_more"] = true;
  if (full_scale) {
    measured["met"] = reached && reaches(value, goal.last, r);
    if (goal.first != goal.last) measured["first_met"] = reached && reaches(value, goal.first, r);
  }
  return measured;
}

std::string cell(const Json& goal, const char* scene) {
  const Json& measured = goal["measured"];
  if (!measured.contains(scene)) return "";
  const Json& m = measured[scene];
  if (m.is_null()) return "-";
  std::string number = fmt::format("{}{:.4g}", m.contains("or_more") ? ">" : "", m["value"].get<double>());
  if (!m.contains("met")) return number;
  return number + (m["met"] == true ? " met" : m.value("first_met", false) ? " first met" : " missed");
}

}  // namespace

const std::vector<Goal>& goals() {
  using enum Unit;
  static const std::vector<Goal> all{
      {"Instant Radiosity, 2550 VPLs, ISM, maps made too",
       "3137 ms",
       "",
       2550,
       {"all lights, ism, maps too"},
       milliseconds,
       5,
       5},
      {"... unshadowed, pixel-VPL pairs per second", "", "", 2550, {"all lights, none"}, pairs_per_second, 1, 1},
      {"Lightcuts, 2550 VPLs, ISM, maps made before", "85 217 ms", "", 2550, {"packet, ism"}, milliseconds, 2.5, 2.5},
      {"Lightcuts, 65 536 VPLs, ISM, maps made before", "", "", 65536, {"packet, ism"}, milliseconds, 6, 6},
      {"Lightcuts, 1 048 576 VPLs, ISM, maps made before", "", "", kMillion, {"packet, ism"}, milliseconds, 8, 8},
      {"Lightcuts, 1 048 576 VPLs, unshadowed", "", "", kMillion, {"packet, none"}, milliseconds, 4, 4},
      {"VPLs from which cuts beat all lights, ISM, maps made before",
       "never",
       "",
       0,
       {"crossing, ism"},
       lights,
       800,
       800},
      {"... maps made too", "never", "", 0, {"crossing, ism, maps too"}, lights, 800, 800},
      {"light tree of 1 048 576 VPLs", "", "", kMillion, {"light tree"}, milliseconds, 3, 1},
      {"tracing 1 048 576 VPLs, 4 bounces",
       "14.1 s for 10 000",
       "veach-ajar",
       kMillion,
       {"vpls, 4 bounces"},
       milliseconds,
       5,
       3},
      {"maps with pull-push, for each 65 536 lights", "", "", 0, {"maps, 65536"}, milliseconds, 3, 3},
      {"pull-push of a 3968x3968 atlas (128x128 maps)",
       "80 ms",
       "study",
       0,
       {"pull-push, 3968, levels", "pull-push, 3968, at once"},
       milliseconds,
       0.1,
       0.1},
      {"everything, from light sources to image, 1 048 576 VPLs, ISM",
       "",
       "",
       kMillion,
       {"everything, ism"},
       milliseconds,
       33,
       20},
      {"shadow rays per second, incoherent", "", "veach-ajar", 0, {"rays, incoherent"}, rays_per_second, 1.5, 1.5},
      {"... a tile's to one light, sums included", "", "veach-ajar", 2550, {"all lights, rays"}, rays_per_second, 3, 3},
      {"Lightcuts, 1 048 576 VPLs, exact shadow rays", "", "study", kMillion, {"packet, rays"}, milliseconds, 200, 200},
      {"Lightcuts, 1 048 576 VPLs, exact shadow rays",
       "",
       "veach-ajar",
       kMillion,
       {"packet, rays"},
       milliseconds,
       350,
       350},
  };
  return all;
}

const Goal* goal_of(const std::string& scene, const std::string& stage, std::uint64_t vpls) {
  const auto found = std::find_if(goals().begin(), goals().end(), [&](const Goal& goal) {
    return is_for(goal, scene) && is_measured_by(goal, stage, vpls);
  });
  return found == goals().end() ? nullptr : &*found;
}

std::string goal_words(const Goal& goal) {
  const char* const unit = reading(goal.unit).name;
  if (goal.first == goal.last) return fmt::format("{:g} {}", goal.last, unit);
  return fmt::format("{:g} {}, then {:g} {}", goal.first, unit, goal.last, unit);
}

Json goals_json(const Json& rows, bool full_scale) {
  Json all = Json::array();
  for (const Goal& goal : goals()) {
    Json one{{"work", goal.work}, {"goal", goal_words(goal)},        {"first", goal.first},
             {"last", goal.last}, {"unit", reading(goal.unit).name}, {"measured", Json::object()}};
    if (*goal.study_2010 != 0) one["study_2010"] = goal.study_2010;
    for (const char* const scene : kScenes) {
      if (!is_for(goal, scene)) continue;
      const Json* const row = best_row(goal, scene, rows);
      one["measured"][scene] = row == nullptr ? Json() : measured_json(goal, *row, full_scale);
    }
    all.push_back(std::move(one));
  }
  return all;
}

std::vector<std::string> goals_table(const Json& goals) {
  constexpr const char* kLine = "{:<61} {:>17} {:>17} {:>16} {:>16}";
  std::vector<std::string> lines{
      fmt::format(kLine, "goals of one H100 at 1000x1000", "study, 2010", "goal", kScenes[0], kScenes[1])};
  for (const Json& goal : goals) {
    lines.push_back(fmt::format(kLine, goal["work"].get<std::string>(), goal.value("study_2010", "-"),
                                goal["goal"].get<std::string>(), cell(goal, kScenes[0]), cell(goal, kScenes[1])));
  }
  return lines;
}

}  // namespace lightcuts::app::frame
