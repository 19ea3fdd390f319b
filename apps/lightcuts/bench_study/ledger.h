#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "bench_study/measure.h"

namespace lightcuts::app::study {

/// What has been measured so far, kept in a file, so that an interrupted run goes on where it stopped.
class Ledger {
 public:
  /// `identity`: commit, device and options; what a file holds of another identity is forgotten. An empty path keeps
  /// everything in memory only.
  Ledger(std::filesystem::path file, Json identity);

  /// The kept result of `key`, or nullptr.
  [[nodiscard]] const Json* find(const std::string& key) const;
  /// Keeps a result, on disk at once. Throws Error{cannot_write, disk_full}.
  const Json& keep(const std::string& key, Json result);

  [[nodiscard]] const Json& all() const { return results_; }

 private:
  std::filesystem::path file_;
  Json identity_;
  Json results_ = Json::object();
};

}  // namespace lightcuts::app::study
