#include "bench_study/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <utility>

#include "bench_study/rooms.h"
#include "console.h"
#include "interruption.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "lightcuts/version.h"
#include "text.h"

namespace lightcuts::app::study {
namespace {

/// Two programs that call themselves the same commit with changes may differ: their file's age tells them apart.
std::string program_identity() {
  std::string name(commit());
  if (!name.ends_with("-dirty") && name != "unknown") return name;
  std::error_code error;
  const auto written = std::filesystem::last_write_time("/proc/self/exe", error);
  const auto target = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto time = error ? written : std::filesystem::last_write_time(target, error);
  return fmt::format("{} of {}", name, error ? 0 : time.time_since_epoch().count());
}

std::filesystem::path default_scenes() {
  const std::filesystem::path beside = "../shared/scenes/rooms";
  return std::filesystem::is_directory(beside) ? beside : std::filesystem::path();
}

BenchRequest with_defaults(BenchRequest request) {
  if (request.scenes.empty()) request.scenes = default_scenes();
  if (request.budget_s <= 0) request.budget_s = sizes_of(request.scale).budget_s;
  return request;
}

Json identity_json(const BenchRequest& request, const std::string& device) {
  // Not the budget: who gives more time wants what was left out, not everything once more.
  return {{"program", program_identity()},
          {"device", device},
          {"threads", request.threads},
          {"scale", sizes_of(request.scale).name},
          {"scenes", request.scenes.string()}};
}

void make_folders(const std::filesystem::path& folder) {
  std::error_code error;
  for (const char* part : {"tables", "pictures", "plots"}) std::filesystem::create_directories(folder / part, error);
  if (error) {
    throw Error(Code::cannot_write, fmt::format("the report's folder {} cannot be made: {}",
                                                shell_quoted(folder.string()), error.message()));
  }
}

struct Part {
  const char* name;
  double share;  ///< of the time, roughly
  void (*make)(Study&);
};

const std::vector<Part>& parts() {
  static const std::vector<Part> all{
      {"table-1", 1, make_table_1},    {"table-2", 10, make_tables_2_and_3},  {"table-4", 4, make_table_4},
      {"table-5", 30, make_table_5},   {"table-6", 15, make_table_6},         {"figures", 1, make_figures},
      {"pictures", 20, make_pictures}, {"convergence", 20, make_convergence}, {"stages", 10, make_stages}};
  return all;
}

std::vector<Part> wanted_parts(const BenchRequest& request) {
  std::vector<std::string> known;
  for (const Part& part : parts()) known.emplace_back(part.name);
  for (const std::string& name : request.parts) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw Error(Code::invalid_argument, fmt::format("the study has no part '{}'; there is {}{}", name, either(known),
                                                    did_you_mean(name, known)));
  }
  std::vector<Part> wanted;
  for (const Part& part : parts()) {
    const bool named = std::find(request.parts.begin(), request.parts.end(), part.name) != request.parts.end();
    if (request.parts.empty() || named) wanted.push_back(part);
  }
  return wanted;
}

void save_results(Study& study) {
  if (study.folder().empty()) return;
  Json json = study.json();
  json["complete"] = study.complete();
  save_text(study.folder() / "study.json", json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

/// Runs the parts in order. Once the user stops them, the rest show what an earlier run has kept of them. A part that fails
/// takes nothing from the others: what it threw is returned when they are done.
std::exception_ptr run_parts(Study& study, const std::vector<Part>& wanted) {
  double total = 0, done = 0;
  for (const Part& part : wanted) total += part.share;
  std::exception_ptr failure;
  for (const Part& part : wanted) {
    study.begin_part(done / total, part.share / total);
    study.until_stopped([&] {
      try {
        part.make(study);
      } catch (const Error& error) {
        study.note(fmt::format("{}: {}", part.name, error.what()));
        if (!failure) failure = std::current_exception();
      }
    });
    done += part.share;
    save_results(study);
  }
  return failure;
}

}  // namespace

Study::Study(const BenchRequest& request)
    : request_(with_defaults(request)), sizes_(sizes_of(request.scale)), bar_(!request.quiet) {
  if (!request_.report.empty()) make_folders(request_.report);
  backend_ = make_bench_backend(request_);
  const std::string device = backend_->device_name();
  on_cpu_ = device.starts_with("cpu");
  const std::filesystem::path kept = request_.report.empty() ? "" : request_.report / "measured.json";
  ledger_ = std::make_unique<Ledger>(kept, identity_json(request_, device));
  // A run that goes on tells of the machine as it was found first: its load is this program's own by now.
  machine_ =
      ledger_->find("machine") != nullptr ? *ledger_->find("machine") : ledger_->keep("machine", machine_json(device));
  progress_ = [](const char*, double) { return !Interruption::requested(); };
}

void Study::stop_if_asked() const {
  if (Interruption::requested()) throw Interrupted{};
}

void Study::until_stopped(const std::function<void()>& work) {
  try {
    work();
  } catch (const Interrupted&) {
    complete_ = false;
  }
}

Json Study::measure(const std::string& key, const std::function<Json()>& make) {
  if (const Json* kept = ledger_->find(key)) return *kept;
  stop_if_asked();
  Json made;
  try {
    made = make();
  } catch (const Error&) {
    stop_if_asked();  // a stage that was stopped leaves nothing for the next one, which says so
    throw;
  }
  stop_if_asked();  // what was stopped half way is no result
  return ledger_->keep(key, std::move(made));
}

Json Study::measure_if_built(const std::string& key, const std::function<Json()>& make) {
  try {
    return measure(key, make);
  } catch (const Error& error) {
    if (error.code() != Code::not_built && error.code() != Code::out_of_memory) throw;
    note(fmt::format("{}: {}", key, error.what()));
    return nullptr;
  }
}

Image Study::shade(const Camera& camera, int side, const ShadeOptions& options, Statistics& statistics) {
  ShadeResult result = backend_->shade(camera, side, side, options, memory_budget(), statistics, progress_);
  stop_if_asked();
  return std::move(result.image);
}

void Study::check(const std::string& what, bool good, const std::string& found) {
  checks_.push_back({{"what", what}, {"good", good}, {"found", found}});
  if (good) return;
  correct_ = false;
  bar_.clear();
  print_warning(fmt::format("{}: {}", what, found));
}

void Study::note(const std::string& text) {
  if (std::find(notes_.begin(), notes_.end(), Json(text)) == notes_.end()) notes_.push_back(text);
}

void Study::add(const Table& table) {
  tables_.push_back(table);
  bar_.clear();
  print_result(table_text(table));
  if (!folder().empty()) save_text(folder() / "tables" / (table.id + ".csv"), table_csv(table));
}

void Study::begin_part(double done, double share) {
  part_start_ = done;
  part_share_ = share;
  show_done(0);
}

void Study::show_done(double done) { bar_.show("study", part_start_ + part_share_ * std::clamp(done, 0.0, 1.0)); }

Json Study::json() const {
  Json tables = Json::object(), pictures = Json::array();
  for (const Table& table : tables_) tables[table.id] = table_json(table);
  for (const Picture& p : pictures_) pictures.push_back({{"id", p.id}, {"file", p.file}, {"caption", p.caption}});
  return {{"machine", machine_},      {"scale", sizes_.name}, {"budget_s", request_.budget_s},
          {"scene", "builtin:study"}, {"tables", tables},     {"pictures", pictures},
          {"facts", facts_},          {"checks", checks_},    {"notes", notes_}};
}

}  // namespace lightcuts::app::study

namespace lightcuts::app {

namespace {

/// What an earlier run, here or elsewhere, left in the report's folder, with its page drawn anew.
BenchResult redraw_page(const BenchRequest& request) {
  const std::filesystem::path file = request.report / "study.json";
  std::ifstream in(file);
  if (!in) {
    throw Error(Code::file_missing,
                fmt::format("there is no {}; a run of the study leaves it there", shell_quoted(file.string())));
  }
  BenchResult result;
  result.json = study::Json::parse(in, nullptr, false);
  if (!result.json.is_object()) {
    throw Error(Code::malformed, fmt::format("{} is damaged; run the study again", shell_quoted(file.string())));
  }
  study::make_page(request.report);
  return result;
}

}  // namespace

BenchResult run_study(const BenchRequest& request) {
  using namespace study;
  if (request.page_only) return redraw_page(request);
  const std::vector<Part> wanted = wanted_parts(request);
  const Interruption interruption;
  Study run(request);
  const std::exception_ptr failure = run_parts(run, wanted);
  run.clear_progress();
  if (failure) std::rethrow_exception(failure);
  BenchResult result;
  result.complete = run.complete();
  result.json = run.json();
  result.json["complete"] = result.complete;
  result.correct = run.correct();
  if (request.report.empty()) return result;
  if (!result.complete) {
    print_note("stopped; the same command goes on where this one ended");
  } else {
    make_page(request.report);
  }
  return result;
}

}  // namespace lightcuts::app
