// Table 1: making VPLs.

#include <fmt/format.h>

#include <cmath>

#include "bench_study/published.h"
#include "bench_study/rooms.h"
#include "bench_study/study.h"

namespace lightcuts::app::study {
namespace {

/// So many light paths of one bounce that `count` VPLs come of them in a closed room, from about as many lights.
VplOptions options_for(std::uint64_t count) {
  VplOptions options;
  options.primary_lights = 10;
  while (options.primary_lights * options.primary_lights * 10 <= count) options.primary_lights *= 10;
  options.vpls_per_light = count / options.primary_lights;
  options.bounces = 1;
  return options;
}

double carried(const Lights& lights) {
  double sum = 0;
  for (std::size_t i = lights.primary_count; i < lights.vpls.size(); ++i) sum += luminance(lights.vpls[i].intensity);
  return sum;
}

Json make_row(Study& study, std::uint64_t count) {
  Backend& backend = study.backend();
  backend.set_scene(study_room(), study.progress());
  backend.trace_vpls(options_for(count), study.progress());
  study.stop_if_asked();
  const std::uint64_t made = backend.lights().vpls.size() - backend.lights().primary_count;
  const double light = carried(backend.lights());
  Json row = times_of_repeated(study.sizes().repeats, study.request().budget_s, [&] {
    const Stopwatch watch;
    backend.trace_vpls(options_for(count), study.progress());
    return stage_time(watch, backend.stage_times().vpls);
  });
  row["made"] = made;
  row["carried"] = light;
  return row;
}

}  // namespace

void make_table_1(Study& study) {
  Table table{"table-1",
              "Table 1. Making VPLs: seconds",
              {"vpls", "seconds", "low", "high", "cpu_seconds", "repeats", "us_per_vpl", "source"},
              {}};
  for (const PublishedTime& p : published_table_1()) {
    table.add({static_cast<std::uint64_t>(p.x), p.seconds, nullptr, nullptr, nullptr, nullptr, 1e6 * p.seconds / p.x,
               kPublished});
  }
  std::vector<double> counts, seconds;
  std::vector<Json> rows;
  study.until_stopped([&] {
    for (const std::uint64_t count : study.sizes().vpl_counts) {
      const Json row = study.measure(fmt::format("table-1/{}", count), [&] { return make_row(study, count); });
      const double wall = row["wall_s"];
      table.add({count, wall, row["low_s"], row["high_s"], row["cpu_s"], row["repeats"],
                 1e6 * wall / static_cast<double>(count), kMeasured});
      counts.push_back(static_cast<double>(count));
      seconds.push_back(wall);
      rows.push_back(row);
      study.show_done(static_cast<double>(counts.size()) / static_cast<double>(study.sizes().vpl_counts.size()));
    }
  });
  // In a closed room every path leaves one VPL, and together they carry the same light however many they are.
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double off = rows[i]["carried"].get<double>() / rows.back()["carried"].get<double>() - 1,
                 allowed = 0.01 + 3 / std::sqrt(counts[i]);
    study.check(fmt::format("table 1, {:.0f} VPLs: number and light carried", counts[i]),
                rows[i]["made"].get<double>() == counts[i] && std::abs(off) < allowed,
                fmt::format("{} made; light differs by {:.2f} % (at most {:.2f} %)",
                            rows[i]["made"].get<std::uint64_t>(), 100 * off, 100 * allowed));
  }
  study.set("table_1_exponent", growth_exponent(counts, seconds));
  study.add(table);
}

}  // namespace lightcuts::app::study
