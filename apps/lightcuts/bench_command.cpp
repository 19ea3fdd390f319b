#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "lightcuts/error.h"
#include "options.h"
#include "render_request.h"
#include "text.h"

namespace lightcuts::app {
namespace {

struct Benchmark {
  const char* name;
  const char* summary;
};

const std::vector<Benchmark>& benchmarks() {
  static const std::vector<Benchmark> all{{"study", "reproduces the study's tables (not built yet)"}};
  return all;
}

struct BenchRequest {
  std::vector<std::string> names;
  bool list = false;
  BackendKind backend = BackendKind::automatic;
  std::string json, report;
};

void check_names(const BenchRequest& request) {
  std::vector<std::string> known;
  for (const Benchmark& benchmark : benchmarks()) known.emplace_back(benchmark.name);
  for (const std::string& name : request.names) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw Error(Code::invalid_argument, fmt::format("there is no benchmark '{}'; there is {}{}", name, either(known),
                                                    did_you_mean(name, known)));
  }
}

int run(const BenchRequest& request) {
  check_names(request);
  if (request.list) {
    for (const Benchmark& benchmark : benchmarks()) {
      print_result(fmt::format("{:<12} {}", benchmark.name, benchmark.summary));
    }
    return kDone;
  }
  throw Error(Code::not_built,
              "no benchmark is part of this version yet: 'study' needs the light tree. What can be measured now: "
              "'./dev bench' in the source tree, or --stats of 'lightcuts render'");
}

}  // namespace

void add_bench_command(CLI::App& program, Action& action) {
  CLI::App* command = program.add_subcommand("bench", "Run benchmarks");
  auto request = std::make_shared<BenchRequest>();
  command->add_option("NAME", request->names, "which (default: all)")->option_text("...");
  command->add_flag("--list", request->list, "only say which there are");
  add_value(
      *command, "--backend", "auto|cpu|cuda",
      [request](const std::string& text) { request->backend = parse_choice(text, kBackends); },
      "processor (default: auto)");
  add_value(
      *command, "--json", "FILE", [request](const std::string& text) { request->json = text; },
      "writes the results as JSON");
  add_value(
      *command, "--report", "DIR", [request](const std::string& text) { request->report = text; },
      "writes tables and pictures into a folder");
  command->callback([request, &action] { action = [request] { return run(*request); }; });
}

}  // namespace lightcuts::app
