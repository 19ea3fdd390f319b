// What each stage costs, and what it takes in memory, by the number of lights. Memory is asked of programs that make one
// picture each, since a program's peak never falls. On a CPU they tell what their stages took, too; a GPU's first
// picture mostly loads kernels, so its stages are timed here, by the device, once they are warm.

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

#include "bench_study/agreement.h"
#include "bench_study/rooms.h"
#include "bench_study/series.h"
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
  arguments.reserve(words.size() + 1);
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
  Method method;
  Visibility visibility;
};
constexpr Way kWays[] = {{"cut, rays", Method::lightcuts, Visibility::rays},
                         {"cut, shadow maps", Method::lightcuts, Visibility::ism},
                         {"all lights, none", Method::instant_radiosity, Visibility::none}};
constexpr const char* kStages[] = {"bvh", "vpls", "tree", "shadow_maps", "shade"};
using StageMs = std::array<double, std::size(kStages)>;

/// What one run of the program says of itself.
Json run_program(Study& study, const Way& way, std::uint64_t count) {
  const Scratch scratch;
  const int side = study.sizes().stage_side;
  std::vector<std::string> words{"render",
                                 "builtin:study",
                                 "--quiet",
                                 "--method",
                                 name_of(way.method, kMethods),
                                 "--size",
                                 fmt::format("{0}x{0}", side),
                                 "--vpls",
                                 std::to_string(count),
                                 "--visibility",
                                 name_of(way.visibility, kVisibilities),
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

VplOptions lights_of(std::uint64_t count) {
  VplOptions options;
  options.count = count;
  return options;
}

StageMs stages_of(const Json& run) {
  StageMs ms{};
  for (std::size_t i = 0; i < ms.size(); ++i) ms[i] = run["time_ms"][kStages[i]];
  return ms;
}

/// Most lights of which a sum is made here, on a CPU and on a GPU: table 5 has those of more.
constexpr std::uint64_t kMostToCheck = 3000, kMostOnGpu = 20000;

/// A cut compared with the sum over the same lights, before it is timed; null for other methods.
Json compare_here(Study& study, const Way& way, std::uint64_t count) {
  if (way.method != Method::lightcuts || count > (study.on_cpu() ? kMostToCheck : kMostOnGpu)) return nullptr;
  Backend& backend = study.backend();
  backend.set_scene(study_room(), study.progress());
  backend.trace_vpls(lights_of(count), study.progress());
  backend.build_light_tree({}, study.progress());
  study.stop_if_asked();
  return compare_cut(study, count, shade_options(way.method, way.visibility));
}

/// One picture from the scene on, by the backend under test, whose device tells the time.
StageMs run_here(Study& study, const Way& way, std::uint64_t count) {
  Backend& backend = study.backend();
  backend.forget_maps();
  const Stopwatch loading;
  backend.set_scene(study_room(), study.progress());
  const double bvh_ms = 1e3 * loading.elapsed().wall_s;
  backend.trace_vpls(lights_of(count), study.progress());
  study.stop_if_asked();
  const bool cut = way.method == Method::lightcuts;
  if (cut) backend.build_light_tree({}, study.progress());
  Statistics unused;
  study.shade(study_room().cameras[0], study.sizes().stage_side, shade_options(way.method, way.visibility), unused);
  const StageTimes ms = backend.stage_times();
  const double drawing = ms.shadow_maps - ms.points;  // maps of cuts' lights are drawn while lights are chosen
  return {bvh_ms, ms.vpls, cut ? ms.tree : 0, ms.shadow_maps, ms.shade - drawing};
}

Json measure_stages(Study& study, const Way& way, std::uint64_t count) {
  const Json compared = compare_here(study, way, count);
  std::vector<StageMs> stages;
  std::vector<Json> programs;
  const int repeats = std::min(3, study.sizes().repeats);
  const double limit_s = study.request().budget_s / 8;
  const Json times = time_repeatedly(study.on_cpu() ? repeats : 1, limit_s,
                                     [&] { programs.push_back(run_program(study, way, count)); });
  if (study.on_cpu()) {
    for (const Json& program : programs) stages.push_back(stages_of(program));
  } else {
    run_here(study, way, count);
    time_repeatedly(study.sizes().repeats, limit_s, [&] { stages.push_back(run_here(study, way, count)); });
  }
  Json found{{"maps", programs[0]["shadow_maps"]["count"]},
             {"vpls", programs[0]["vpls"]["count"]},
             {"process_s", times["wall_s"]},
             {"repeats", stages.size()},
             {"compared", compared}};
  double sum_ms = 0;
  for (std::size_t i = 0; i < std::size(kStages); ++i) {
    std::vector<double> values;
    values.reserve(stages.size());
    for (const StageMs& one : stages) values.push_back(one[i]);
    const Repeats r = summarise(values);
    found["stages"][kStages[i]] = {{"ms", r.median}, {"low", r.low}, {"high", r.high}};
    sum_ms += r.median;
  }
  found["seconds"] = sum_ms / 1e3;
  for (const char* place : {"host_peak", "device_peak"}) {
    std::vector<double> values;
    values.reserve(programs.size());
    for (const Json& program : programs) values.push_back(program["memory_bytes"][place]);
    found[place] = summarise(values).median;
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
    Series series;
    study.until_stopped([&] {
      for (const std::uint64_t count : study.sizes().stage_vpls) {
        done += 1.0 / static_cast<double>(std::size(kWays) * study.sizes().stage_vpls.size());
        if (series.expected(static_cast<double>(count)) > study.request().budget_s) {
          study.note(fmt::format("stages, {}, {} VPLs: left out, for it would take too long", way.name, count));
          continue;
        }
        const Json found = study.measure_if_built(fmt::format("stages/{}/{}", way.name, count),
                                                  [&] { return measure_stages(study, way, count); });
        if (found.is_null()) continue;
        check_cut(study, fmt::format("stages, {}, {} VPLs", way.name, count), found["compared"]);
        series.add(static_cast<double>(count), found["seconds"]);
        const auto ms = [&](const char* stage) { return found["stages"][stage]["ms"]; };
        const auto megabytes = [&](const char* place) { return found[place].get<double>() / 1e6; };
        table.add({way.name, found["vpls"], ms("bvh"), ms("vpls"), ms("tree"), ms("shadow_maps"), ms("shade"),
                   found["stages"]["shade"]["low"], found["stages"]["shade"]["high"], found["repeats"], found["maps"],
                   megabytes("host_peak"), megabytes("device_peak"), kMeasured});
        study.show_done(done);
      }
    });
  }
  study.add(table);
}

}  // namespace lightcuts::app::study
