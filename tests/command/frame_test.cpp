#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "bench_frame/goals.h"
#include "bench_frame/parts.h"
#include "command.h"
#include "lightcuts/error.h"

namespace lightcuts::app::frame {
namespace {

using test::ProgramResult;
using test::run_lightcuts;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

Json row(const char* scene, std::uint64_t vpls, const char* stage, const char* figure, double value) {
  return {{"scene", scene}, {"vpls", vpls}, {"stage", stage}, {figure, value}};
}

/// The goal of whose work `words` are a part.
Json find_goal(const Json& all, const std::string& words) {
  for (const Json& goal : all) {
    if (goal["work"].get<std::string>().find(words) != std::string::npos) return goal;
  }
  return {};
}

TEST(FrameGoals, AreMetMissedOrNotMeasured) {
  const Json rows{row("study", 1048576, "light tree", "median_ms", 0.9),
                  row("veach-ajar", 1048576, "light tree", "median_ms", 2),
                  row("study", 65536, "light tree", "median_ms", 100),  // of other lights: no goal
                  row("study", 2550, "all lights, none", "pairs_per_s", 1.25e12),
                  row("veach-ajar", 2550, "all lights, none", "pairs_per_s", 0.75e12)};
  const Json all = goals_json(rows, true);
  EXPECT_EQ(all.size(), goals().size());
  const Json tree = find_goal(all, "light tree")["measured"], pairs = find_goal(all, "pairs per second")["measured"];
  EXPECT_EQ(tree["study"], Json({{"value", 0.9}, {"met", true}, {"first_met", true}}));
  EXPECT_EQ(tree["veach-ajar"], Json({{"value", 2.0}, {"met", false}, {"first_met", true}}));
  EXPECT_EQ(pairs["study"], Json({{"value", 1.25}, {"met", true}}));
  EXPECT_EQ(pairs["veach-ajar"], Json({{"value", 0.75}, {"met", false}}));
  EXPECT_EQ(find_goal(all, "65 536 VPLs, ISM")["measured"]["study"], Json());
  const std::vector<std::string> lines = goals_table(all);
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("light tree"), HasSubstr("0.9 met"), HasSubstr("2 first met"))));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("pairs"), HasSubstr("1.25 met"), HasSubstr("0.75 missed"))));
}

TEST(FrameGoals, AreMarkedAtFullScaleOnly) {
  const Json all = goals_json(Json::array({row("study", 1048576, "light tree", "median_ms", 0.9)}), false);
  EXPECT_EQ(find_goal(all, "light tree")["measured"]["study"], Json({{"value", 0.9}}));
}

TEST(FrameGoals, CountTheBestOfSeveralWays) {
  const Json all = goals_json({row("study", 0, "pull-push, 3968, levels", "median_ms", 0.106),
                               row("study", 0, "pull-push, 3968, at once", "median_ms", 0.034)},
                              true);
  EXPECT_EQ(find_goal(all, "pull-push of")["measured"], Json({{"study", {{"value", 0.034}, {"met", true}}}}));
}

TEST(FrameGoals, AreMissedWhereCutsAreNeverFaster) {
  Json never = row("study", 300, "crossing, ism", "median_ms", 1);
  never["crossed"] = false;
  const Json all = goals_json(Json::array({never}), true);
  EXPECT_EQ(find_goal(all, "beat all lights")["measured"]["study"]["met"], false);
  EXPECT_THAT(goals_table(all), Contains(HasSubstr(">300 missed")));
}

TEST(FrameGoals, AreOfStagesThatExist) {
  const Parts parts({});
  for (const Goal& goal : goals()) {
    for (const char* const stage : goal.stages) EXPECT_TRUE(parts.wants_stage(stage)) << goal.work;
  }
}

TEST(FrameParts, AreScenesNumbersAndPartsOfStages) {
  const Parts parts({"study", "800", "ism"});
  EXPECT_TRUE(parts.wants_scene("study"));
  EXPECT_FALSE(parts.wants_scene("veach-ajar"));
  EXPECT_TRUE(parts.wants_lights(800));
  EXPECT_FALSE(parts.wants_lights(2550));
  EXPECT_TRUE(parts.wants_stage("packet, ism"));
  EXPECT_FALSE(parts.wants_stage("packet, none"));
  EXPECT_THROW(Parts({"0"}), Error);
}

TEST(BenchFrame, EndsWithItsGoals) {
  const fs::path json = fs::temp_directory_path() / ("lightcuts-frame-" + std::to_string(getpid()) + ".json");
  const ProgramResult r = run_lightcuts({"bench", "frame", "--backend", "cpu", "--scale", "smoke", "--json",
                                         json.string(), "--part", "study", "none", "tree", "incoherent"});
  ASSERT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(r.out,
              AllOf(HasSubstr("85 217 ms"), HasSubstr("33 ms, then 20 ms"), HasSubstr("nothing is met or missed")));
  std::ifstream in(json);
  const nlohmann::json frame = nlohmann::json::parse(in)["frame"];
  fs::remove(json);
  EXPECT_EQ(frame["goals"].size(), goals().size());
  std::vector<std::string> stages;
  for (const nlohmann::json& row : frame["rows"]) {
    EXPECT_EQ(row["scene"], "study");
    stages.push_back(row["stage"]);
  }
  EXPECT_THAT(stages, AllOf(Contains("packet, none"), Contains("small, none"), Contains("rays, incoherent"),
                            Not(Contains("packet, ism"))));
}

TEST(BenchFrame, MeasuresNumbersOfLightsThatNoListHas) {
  const ProgramResult r = run_lightcuts(
      {"bench", "frame", "--backend", "cpu", "--scale", "smoke", "--part", "study", "55", "packet, none", "crossing"});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(r.out, AllOf(HasSubstr(" 55 packet, none"), Not(HasSubstr("200 packet")), Not(HasSubstr("crossing"))));
}

TEST(BenchFrame, FindsFromWhichNumberOnCutsAreFaster) {
  const ProgramResult r =
      run_lightcuts({"bench", "frame", "--backend", "cpu", "--scale", "smoke", "--part", "study", "crossing, ism"});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(r.out,
              AllOf(HasSubstr("crossing, ism "), HasSubstr("crossing, ism, maps too"), HasSubstr("all lights ")));
}

TEST(BenchFrame, SaysSoWherePartsNameNothing) {
  const ProgramResult unknown = run_lightcuts({"bench", "frame", "--part", "light trees"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("light trees"), HasSubstr("did you mean 'light tree'")));
  EXPECT_EQ(run_lightcuts({"bench", "--part", "light tree"}).status, 2);  // of which benchmark?
  const ProgramResult none =
      run_lightcuts({"bench", "frame", "--backend", "cpu", "--scale", "smoke", "--part", "study", "200", "crossing"});
  EXPECT_EQ(none.status, 0);
  EXPECT_THAT(none.err, HasSubstr("no measurement is in all of them"));
}

}  // namespace
}  // namespace lightcuts::app::frame
