#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "bench.h"
#include "bench_study/ledger.h"
#include "bench_study/measure.h"
#include "bench_study/sizes.h"
#include "bench_study/table.h"
#include "progress_bar.h"

namespace lightcuts::app::study {

/// Thrown where the user asked to stop and the next result is not kept yet; what was measured before is.
struct Interrupted {};

/// A picture or figure's data that the page shows.
struct Picture {
  std::string id, file, caption;
};

/// One run of the study: what its parts share.
class Study {
 public:
  explicit Study(const BenchRequest& request);

  [[nodiscard]] const BenchRequest& request() const { return request_; }
  [[nodiscard]] const Sizes& sizes() const { return sizes_; }
  /// The backend under test.
  Backend& backend() { return *backend_; }
  [[nodiscard]] bool on_cpu() const { return on_cpu_; }

  /// The kept result of `key`, or that of `make`, which is kept. Throws Interrupted before or after `make`.
  Json measure(const std::string& key, const std::function<Json()>& make);
  /// As `measure`, where the backend may not be able to: nullptr then, and the reason is noted once.
  Json measure_if_built(const std::string& key, const std::function<Json()>& make);

  /// To be handed to every stage; says stop once the user asked to.
  [[nodiscard]] const ProgressFn& progress() const { return progress_; }
  /// Throws Interrupted if the user asked to stop; to be called after every stage.
  void stop_if_asked() const;
  /// Does `work` until it ends or is interrupted; the part goes on with what it has by then.
  void until_stopped(const std::function<void()>& work);
  [[nodiscard]] bool complete() const { return complete_; }

  /// A square picture of what the backend holds. Throws Interrupted if the user asked to stop.
  Image shade(const Camera& camera, int side, const ShadeOptions& options, Statistics& statistics);

  /// A result that was compared with its reference before it was timed.
  void check(const std::string& what, bool good, const std::string& found);
  void note(const std::string& text);
  void add(const Table& table);
  void add(const Picture& picture) { pictures_.push_back(picture); }
  void set(const std::string& name, Json value) { facts_[name] = std::move(value); }

  /// Folder for pictures; empty where no report was asked for.
  [[nodiscard]] const std::filesystem::path& folder() const { return request_.report; }

  void begin_part(double done, double share);
  /// `done` of the part that was begun, 0 to 1.
  void show_done(double done);

  /// Everything, as it goes to the JSON file and the page.
  [[nodiscard]] Json json() const;
  [[nodiscard]] bool correct() const { return correct_; }
  void clear_progress() { bar_.clear(); }

 private:
  BenchRequest request_;
  Sizes sizes_;
  std::unique_ptr<Backend> backend_;
  bool on_cpu_ = true;
  Json machine_;
  std::unique_ptr<Ledger> ledger_;
  ProgressFn progress_;
  ProgressBar bar_;
  double part_start_ = 0, part_share_ = 0;
  std::vector<Table> tables_;
  std::vector<Picture> pictures_;
  Json checks_ = Json::array(), notes_ = Json::array(), facts_ = Json::object();
  bool correct_ = true, complete_ = true;
};

// The parts, a file each.
void make_table_1(Study& study);
void make_tables_2_and_3(Study& study);
void make_table_4(Study& study);
void make_table_5(Study& study);
void make_table_6(Study& study);
void make_figures(Study& study);
void make_pictures(Study& study);
void make_convergence(Study& study);
void make_stages(Study& study);

/// Calls the plotting script that comes with the program. Says so, in one sentence, where it cannot run.
/// Returns false then.
bool make_page(const std::filesystem::path& folder);

}  // namespace lightcuts::app::study
