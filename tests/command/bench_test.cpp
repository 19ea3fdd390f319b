#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "command.h"

namespace lightcuts::test {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

/// A report's folder, removed at the end.
class ReportFolder {
 public:
  explicit ReportFolder(const char* name)
      : path(fs::temp_directory_path() / ("lightcuts-bench-" + std::to_string(getpid()) + "-" + name)) {
    fs::remove_all(path);
  }
  ~ReportFolder() { fs::remove_all(path); }
  ReportFolder(const ReportFolder&) = delete;
  ReportFolder& operator=(const ReportFolder&) = delete;
  const fs::path path;
};

nlohmann::json read_json(const fs::path& path) {
  std::ifstream in(path);
  return nlohmann::json::parse(in, nullptr, false);
}

std::vector<std::string> study_words(const ReportFolder& folder, const char* scale, std::vector<std::string> more) {
  std::vector<std::string> words{"bench", "study",    "--backend",          "cpu",      "--scale",
                                 scale,   "--report", folder.path.string(), "--scenes", folder.path.string()};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(Bench, FinishedMeasurementsAreNotRepeated) {
  const ReportFolder folder("again");
  const std::vector<std::string> words = study_words(folder, "smoke", {"--part", "table-1"});
  ASSERT_EQ(run_lightcuts(words).status, 0);
  const nlohmann::json first = read_json(folder.path / "study.json")["tables"];
  ASSERT_EQ(run_lightcuts(words).status, 0);
  EXPECT_EQ(read_json(folder.path / "study.json")["tables"], first);  // times too, to the last digit
  std::vector<std::string> longer = words;
  longer.insert(longer.end(), {"--budget", "5"});
  ASSERT_EQ(run_lightcuts(longer).status, 0);
  EXPECT_EQ(read_json(folder.path / "study.json")["tables"], first);  // more time adds what was left out: nothing here
  EXPECT_TRUE(fs::exists(folder.path / "tables" / "table-1.csv"));
}

TEST(Bench, APageIsDrawnOfARunFromElsewhere) {
  const ReportFolder folder("page");
  const std::vector<std::string> words{"bench", "study", "--page", "--report", folder.path.string()};
  EXPECT_EQ(run_lightcuts(words).status, 3);  // there is none yet
  EXPECT_EQ(run_lightcuts({"bench", "study", "--page"}).status, 2);
  ASSERT_EQ(run_lightcuts(study_words(folder, "smoke", {"--part", "table-1"})).status, 0);
  nlohmann::json study = read_json(folder.path / "study.json");
  study["machine"]["device"] = "cuda: of another machine";
  std::ofstream(folder.path / "study.json") << study;
  fs::remove(folder.path / "index.html");
  EXPECT_EQ(run_lightcuts(words).status, 0);
  EXPECT_EQ(read_json(folder.path / "study.json"), study);
}

TEST(Bench, MarksWhatIsPublished) {
  const ReportFolder folder("published");
  const ProgramResult r = run_lightcuts(study_words(folder, "smoke", {"--part", "table-1"}));
  ASSERT_EQ(r.status, 0) << r.err;
  const nlohmann::json table = read_json(folder.path / "study.json")["tables"]["table-1"];
  int published = 0, measured = 0;
  for (const nlohmann::json& row : table["rows"]) {
    published += row.back() == "published" ? 1 : 0;
    measured += row.back() == "measured" ? 1 : 0;
  }
  EXPECT_EQ(published, 3);
  EXPECT_EQ(measured, 2);
  EXPECT_EQ(table["rows"][2][1], 14.1);
}

TEST(Bench, AnInterruptedRunKeepsWhatItHasAndGoesOn) {
  const ReportFolder folder("interrupted");
  const std::vector<std::string> words = study_words(folder, "small", {"--part", "table-2", "figures"});
  {
    Program program(lightcuts_words(words), {});
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const auto has_measured = [&] {
      const nlohmann::json kept = read_json(folder.path / "measured.json");
      return kept.is_object() && kept["results"].size() > 1;  // more than the machine
    };
    while (!has_measured() && std::chrono::steady_clock::now() < limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    program.send(SIGINT);
    EXPECT_EQ(program.wait(), 130);
    EXPECT_THAT(program.err(), HasSubstr("goes on where this one ended"));
  }
  const nlohmann::json kept = read_json(folder.path / "measured.json");
  ASSERT_TRUE(kept.contains("results"));
  ASSERT_GT(kept["results"].size(), 1u);
  const nlohmann::json study = read_json(folder.path / "study.json");
  EXPECT_FALSE(study["complete"]);
  EXPECT_EQ(study["tables"]["table-2-3"]["rows"].back().back(), "measured");  // what the part had by then
  EXPECT_TRUE(study["facts"].contains("tree"));                               // and what needs no measuring of the next
}

TEST(Bench, UnknownPartsAreRefusedWithAProposal) {
  const ProgramResult r = run_lightcuts({"bench", "study", "--part", "tabel-1"});
  EXPECT_EQ(r.status, 2);
  EXPECT_THAT(r.err, HasSubstr("did you mean 'table-1'"));
}

}  // namespace
}  // namespace lightcuts::test
