#include "bench_study/ledger.h"

#include <fstream>
#include <utility>

#include "lightcuts/io.h"

namespace lightcuts::app::study {

Ledger::Ledger(std::filesystem::path file, Json identity) : file_(std::move(file)), identity_(std::move(identity)) {
  if (file_.empty()) return;
  std::ifstream in(file_);
  if (!in) return;
  // A file that is damaged or of another run is no mistake of the user's: it is measured again.
  Json kept = Json::parse(in, nullptr, false);
  if (!kept.is_object() || kept.value("identity", Json()) != identity_) return;
  if (kept.contains("results") && kept["results"].is_object()) results_ = std::move(kept["results"]);
}

const Json* Ledger::find(const std::string& key) const {
  const auto found = results_.find(key);
  return found == results_.end() ? nullptr : &*found;
}

const Json& Ledger::keep(const std::string& key, Json result) {
  results_[key] = std::move(result);
  if (!file_.empty()) {
    const Json kept{{"identity", identity_}, {"results", results_}};
    save_text(file_, kept.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  }
  return results_[key];
}

}  // namespace lightcuts::app::study
