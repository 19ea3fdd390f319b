#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "bench.h"
#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "options.h"
#include "render_request.h"
#include "text.h"

namespace lightcuts::app {
namespace {

const std::vector<Choice<BenchScale>> kScales{{"smoke", BenchScale::smoke},
                                              {"quick", BenchScale::quick},
                                              {"small", BenchScale::small},
                                              {"medium", BenchScale::medium},
                                              {"full", BenchScale::full}};

constexpr const char* kFooter = R"(
Examples:
  lightcuts bench --list
  lightcuts bench study --quick --report out/study      two minutes, then out/study/index.html
  lightcuts bench study --report out/study              everything; interrupt it and call it again to go on
  lightcuts bench study --part table-2 table-3 --json tables.json
  lightcuts bench frame --part veach-ajar 2550 "packet, ism" --json frame.json

Exit status: 0 done, 1 a result did not agree with its reference, 2 wrong usage, 130 interrupted.)";

void check_names(const BenchRequest& request) {
  std::vector<std::string> known;
  for (const Benchmark& benchmark : benchmarks()) known.emplace_back(benchmark.name);
  for (const std::string& name : request.names) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw Error(Code::invalid_argument, fmt::format("there is no benchmark '{}'; there is {}{}", name, either(known),
                                                    did_you_mean(name, known)));
  }
}

bool is_wanted(const Benchmark& benchmark, const std::vector<std::string>& names) {
  return names.empty() || std::find(names.begin(), names.end(), benchmark.name) != names.end();
}

int run(const BenchRequest& request) {
  check_names(request);
  if (request.list) {
    for (const Benchmark& benchmark : benchmarks()) {
      print_result(fmt::format("{:<12} {}", benchmark.name, benchmark.summary));
    }
    return kDone;
  }
  if (request.page_only && (request.report.empty() || request.names != std::vector<std::string>{"study"})) {
    throw Error(Code::invalid_argument, "--page is for a run that is there: lightcuts bench study --page --report DIR");
  }
  if (!request.parts.empty() && request.names.size() != 1) {
    throw Error(Code::invalid_argument,
                "--part is of one benchmark: name it, as in lightcuts bench study --part table-1");
  }
  if (!request.json.empty()) check_writable(request.json);
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  bool correct = true, complete = true;
  for (const Benchmark& benchmark : benchmarks()) {
    if (!is_wanted(benchmark, request.names) || !complete) continue;
    BenchResult result = benchmark.run(request);
    correct = correct && result.correct;
    complete = complete && result.complete;
    all[benchmark.name] = std::move(result.json);
  }
  if (!request.json.empty()) {
    save_text(request.json, all.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  }
  return !complete ? kInterrupted : correct ? kDone : kPastLimit;
}

}  // namespace

void add_bench_command(CLI::App& program, Action& action) {
  CLI::App* command = program.add_subcommand("bench", "Run benchmarks");
  command->footer(kFooter);
  auto request = std::make_shared<BenchRequest>();
  command->add_option("NAME", request->names, "which (default: all)")->option_text("...");
  command->add_flag("--list", request->list, "only say which there are");
  add_value(
      *command, "--backend", "auto|cpu|cuda",
      [request](const std::string& text) { request->backend = parse_choice(text, kBackends); },
      "processor (default: auto)");
  add_value(
      *command, "--device", "N",
      [request](const std::string& text) { request->device = static_cast<int>(parse_count(text, 0, 1023)); },
      "which GPU (default: 0)");
  add_value(
      *command, "--threads", "T",
      [request](const std::string& text) { request->threads = static_cast<int>(parse_count(text, 0, 4096)); },
      "threads of the CPU (default: all)");
  add_value(
      *command, "--json", "FILE", [request](const std::string& text) { request->json = text; },
      "writes the results as JSON");
  add_value(
      *command, "--report", "DIR", [request](const std::string& text) { request->report = text; },
      "writes tables, plots and a page; what an earlier run\nof the same program left there is not measured again");
  add_value(
      *command, "--scale", "smoke|quick|small|medium|full",
      [request](const std::string& text) { request->scale = parse_choice(text, kScales); },
      "how much: some seconds, two minutes, some ten\nminutes on two cores, or on sixteen, all\n(default: full)");
  command->add_flag_callback(
      "--quick", [request] { request->scale = BenchScale::quick; }, "the same as --scale quick");
  add_value(
      *command, "--scenes", "DIR", [request](const std::string& text) { request->scenes = text; },
      "rooms of `study`, as DIR/NAME/scene.gltf\n(default: `rooms` in the folder LIGHTCUTS_SCENES,\nelse "
      "../shared/scenes/rooms where it exists)");
  add_value(
      *command, "--budget", "SECONDS",
      [request](const std::string& text) { request->budget_s = parse_number(text, 0.01, 1e6); },
      "leaves out what would take longer than this each");
  command
      ->add_option("--part", request->parts,
                   "only these parts of `study`; of `frame` scenes, numbers of\nlights, and stages by a part of their "
                   "names (default: all)")
      ->option_text("NAME...");
  command->add_flag(
      "--page", request->page_only,
      "measures nothing: draws anew the plots and the page\nof what `study` left in --report, on whatever machine");
  command->add_flag("--quiet", request->quiet, "no progress");
  command->callback([request, &action] {
    const char* const scenes = std::getenv("LIGHTCUTS_SCENES");
    if (request->scenes.empty() && scenes != nullptr) request->scenes = std::filesystem::path(scenes) / "rooms";
    action = [request] { return run(*request); };
  });
}

}  // namespace lightcuts::app
