#pragma once

#include <string>
#include <vector>

#include "bench_study/measure.h"

namespace lightcuts::app::study {

inline constexpr const char* kMeasured = "measured";
inline constexpr const char* kPublished = "published";
/// A row whose figure was neither: it would have taken too long, or the backend cannot do it yet.
inline constexpr const char* kLeftOut = "left out";

/// A table of the report. Its last column tells for each row where the figures are from.
struct Table {
  std::string id;     ///< file name without ending
  std::string title;  ///< one line
  std::vector<std::string> columns;
  std::vector<std::vector<Json>> rows;

  void add(std::vector<Json> row) { rows.push_back(std::move(row)); }
};

Json table_json(const Table& table);
/// Comma-separated values, RFC 4180.
std::string table_csv(const Table& table);
/// For a terminal: columns aligned, numbers to four digits.
std::string table_text(const Table& table);

}  // namespace lightcuts::app::study
