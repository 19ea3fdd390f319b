#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace lightcuts::app::frame {

using Json = nlohmann::ordered_json;

/// What a goal is counted in, and so which figure of a measurement it is read from.
enum class Unit { milliseconds, pairs_per_second, rays_per_second, lights };

/// What the project asks of one H100, at kGoalSide pixels a side.
struct Goal {
  const char* work;
  const char* study_2010;           ///< what the study of 2010 took for it; empty: nothing like it is in there
  const char* scene;                ///< where it is asked for; empty: in both
  std::uint64_t vpls;               ///< of the measurement; 0: whichever number it has
  std::vector<const char*> stages;  ///< of the measurement; of several the best counts
  Unit unit;
  double first, last;  ///< what was asked for at first and what then; the same where that is one
};

inline constexpr int kGoalSide = 1000;

/// All of them. Nowhere else is a goal of `bench frame` written down.
const std::vector<Goal>& goals();

/// The goal of a measurement, or null.
const Goal* goal_of(const std::string& scene, const std::string& stage, std::uint64_t vpls);

/// "33 ms, then 20 ms".
std::string goal_words(const Goal& goal);

/// The goals beside what was measured: `rows` as `bench frame` writes them. Whether they are met is said at full scale
/// only.
Json goals_json(const Json& rows, bool full_scale);

/// The lines of a table of goals_json.
std::vector<std::string> goals_table(const Json& goals);

}  // namespace lightcuts::app::frame
