// What each stage costs, and what it takes in memory, by the number of lights: each measurement is a program of its own,
// since a program's peak of memory never falls.

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <vector>

#include "bench_study/rooms.h"
#include "bench_study/study.h"
#include "exit_status.h"
#include "lightcuts/error.h"
#include "render_request.h"

namespace lightcuts::app::study {
namespace {

/// Runs this program with other words, its output thrown away. Returns its exit status.
int run_self(std::vector<std::string> words) {
  words.insert(words.begin(), "/proc/self/exe");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const int out : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&files, out, "/dev/null", O_WRONLY, 0);
  }
  pid_t child = 0;
  const int failed = posix_spawn(&child, "/proc/self/exe", &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) return kInternal;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : kInternal;
}

/// A folder that goes with its content.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "lightcuts-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw Error(Code::cannot_write, "no folder can be made in " + name);
    folder_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] std::string file(const char* name) const { return (folder_ / name).string(); }

 private:
  std::filesystem::path folder_;
};

struct Way {
  const char* name;
  const char* method;
  const char* visibility;
};
constexpr Way kWays[] = {{"cut, rays", "lightcuts", "rays"},
                         {"cut, shadow maps", "lightcuts", "ism"},
                         {"all lights, none", "instant-radiosity", "none"}};

/// What one run of the program says of itself.
Json run_program(Study& study, const Way& way, std::uint64_t count) {
  const Scratch scratch;
  const int side = study.sizes().stage_side;
  std::vector<std::string> words{"render",
                                 "builtin:study",
                                 "--quiet",
                                 "--method",
                                 way.method,
                                 "--size",
                                 fmt::format("{0}x{0}", side),
                                 "--vpls",
                                 std::to_string(count),
                                 "--visibility",
                                 way.visibility,
                                 "--backend",
                                 study.on_cpu() ? "cpu" : "cuda",
                                 "--device",
                                 std::to_string(study.request().device),
                                 "--stats",
                                 scratch.file("stats.json"),
                                 "-o",
                                 scratch.file("x.exr")};
  if (study.request().threads > 0) words.insert(words.end(), {"--threads", std::to_string(study.request().threads)});
  const int status = run_self(words);
  study.stop_if_asked();
  if (status == kNoRoom) throw Error(Code::out_of_memory, "there is not enough memory");
  if (status != kDone) throw Error(Code::not_built, fmt::format("'lightcuts render' ended with status {}", status));
  std::ifstream in(scratch.file("stats.json"));
  return Json::parse(in);
}

/// Middle one of what several runs say under one name of one group, with its spread.
Repeats repeats_of(const std::vector<Json>& runs, const char* group, const char* name) {
  std::vector<double> values;
  for (const Json& run : runs) values.push_back(run[group][name]);
  return summarise(values);
}

Json measure_program(Study& study, const Way& way, std::uint64_t count) {
  std::vector<Json> runs;
  const Json times = time_repeatedly(std::min(3, study.sizes().repeats), study.request().budget_s / 8,
                                     [&] { runs.push_back(run_program(study, way, count)); });
  Json found{{"maps", runs[0]["shadow_maps"]["count"]},
             {"vpls", runs[0]["vpls"]["count"]},
             {"process_s", times["wall_s"]},
             {"repeats", times["repeats"]}};
  for (const char* stage : {"bvh", "vpls", "tree", "shadow_maps", "shade"}) {
    const Repeats r = repeats_of(runs, "time_ms", stage);
    found["stages"][stage] = {{"ms", r.median}, {"low", r.low}, {"high", r.high}};
  }
  for (const char* place : {"host_peak", "device_peak"}) {
    found[place] = repeats_of(runs, "memory_bytes", place).median;
  }
  return found;
}

}  // namespace

void make_stages(Study& study) {
  Table table{"stages",
              fmt::format("Cost of each stage [ms] and memory [MB] by number of lights, {0}x{0} pixels",
                          study.sizes().stage_side),
              {"method", "vpls", "bvh_ms", "vpls_ms", "tree_ms", "maps_ms", "shade_ms", "shade_low", "shade_high",
               "repeats", "maps", "host_mb", "device_mb", "source"},
              {}};
  double done = 0;
  for (const Way& way : kWays) {
    double last_s = 0;
    for (const std::uint64_t count : study.sizes().stage_vpls) {
      done += 1.0 / static_cast<double>(std::size(kWays) * study.sizes().stage_vpls.size());
      if (5 * last_s > study.request().budget_s) {
        study.note(fmt::format("stages, {}, {} VPLs: left out, for it would take too long", way.name, count));
        continue;
      }
      const Json found = study.measure_if_built(fmt::format("stages/{}/{}", way.name, count),
                                                [&] { return measure_program(study, way, count); });
      if (found.is_null()) continue;
      last_s = found["process_s"];
      const auto ms = [&](const char* stage) { return found["stages"][stage]["ms"]; };
      const auto megabytes = [&](const char* place) { return found[place].get<double>() / 1e6; };
      table.add({way.name, found["vpls"], ms("bvh"), ms("vpls"), ms("tree"), ms("shadow_maps"), ms("shade"),
                 found["stages"]["shade"]["low"], found["stages"]["shade"]["high"], found["repeats"], found["maps"],
                 megabytes("host_peak"), megabytes("device_peak"), kMeasured});
      study.show_done(done);
    }
  }
  study.add(table);
}

}  // namespace lightcuts::app::study
