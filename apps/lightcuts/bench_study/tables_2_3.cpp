// Tables 2 and 3: how large cuts are, by the metric that clusters the lights, and by the builder.

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "bench_study/published.h"
#include "bench_study/rooms.h"
#include "bench_study/study.h"
#include "lightcuts/error.h"
#include "render_request.h"

namespace lightcuts::app::study {
namespace {

/// A way to make the tree.
struct Way {
  TreeBuilder builder;
  Metric metric;
  [[nodiscard]] std::string name() const {
    return fmt::format("{}, {}", name_of(metric, kMetrics), name_of(builder, kTreeBuilders));
  }
};

std::vector<Way> ways() {
  std::vector<Way> all;
  all.reserve(kMetrics.size() + 2);
  for (const auto& metric : kMetrics) all.push_back({TreeBuilder::agglomerative, metric.value});
  all.push_back({TreeBuilder::ploc, Metric::walter});
  all.push_back({TreeBuilder::morton, Metric::walter});
  return all;
}

/// Pixels a side at which the sum over all lights takes about as long as everything else.
int check_side(int side, std::uint64_t lights) {
  const double affordable = std::sqrt(1.5e7 / static_cast<double>(lights));
  return std::max(8, std::min(side, static_cast<int>(affordable)));
}

Image shade(Study& study, int side, const ShadeOptions& options, Statistics& statistics) {
  return study.shade(study_room().cameras[0], side, options, statistics);
}

/// The study's cut: a heap for each pixel, of at most 1000 nodes.
ShadeOptions cut_options() {
  ShadeOptions options = shade_options(Method::lightcuts, Visibility::rays);
  options.max_cut = kStudyMaxCut;
  options.cut = CutWalk::heap;
  return options;
}

/// Cut sizes of all ways for one set of lights; checked against the sum over all lights for the first seed.
Json measure_seed(Study& study, std::uint64_t n, std::uint64_t seed) {
  Backend& backend = study.backend();
  backend.set_scene(study_room(), study.progress());
  backend.trace_vpls(study_lights(n, seed), study.progress());
  study.stop_if_asked();
  const int side = check_side(study.sizes().cut_side, light_count(n));
  Statistics unused;
  Image all_lights;
  if (seed == 1) {
    all_lights = shade(study, side, shade_options(Method::instant_radiosity, Visibility::rays), unused);
  }
  Json found = Json::object();
  for (const Way& way : ways()) {
    const Stopwatch watch;
    backend.build_light_tree({way.builder, way.metric, seed}, study.progress());
    const double build_s = watch.elapsed().wall_s;
    Statistics statistics;
    const Image image = shade(study, study.sizes().cut_side, cut_options(), statistics);
    Json row{{"cut", statistics.cut.mean}, {"at_limit", statistics.cut.at_limit}, {"build_s", build_s}};
    if (seed == 1) {
      const Image& same_size = side == study.sizes().cut_side ? image : shade(study, side, cut_options(), unused);
      row["error"] = mean_error(same_size, all_lights);
    }
    found[way.name()] = std::move(row);
  }
  return found;
}

/// A cut's nodes are each bounded to 2 % of the pixel; together they are off by about that.
constexpr double kMostError = 0.04;

void add_rows(Study& study, Table& table, std::uint64_t n, const std::vector<Json>& seeds) {
  for (const Way& way : ways()) {
    std::vector<double> cuts;
    cuts.reserve(seeds.size());
    for (const Json& seed : seeds) cuts.push_back(seed[way.name()]["cut"]);
    const Spread spread = spread_of(cuts);
    const Json& first = seeds.front()[way.name()];
    const double error = first["error"];
    study.check(fmt::format("cuts of {} lights, {}: error against all lights", light_count(n), way.name()),
                error <= kMostError, fmt::format("{:.2f} % (at most {:.0f} %)", 100 * error, 100 * kMostError));
    table.add({light_count(n), name_of(way.metric, kMetrics), name_of(way.builder, kTreeBuilders), spread.mean,
               spread.deviation, seeds.size(), spread.mean / static_cast<double>(light_count(n)), 100 * error,
               first["at_limit"], kMeasured});
  }
}

}  // namespace

void make_tables_2_and_3(Study& study) {
  Table table{"table-2-3",
              "Tables 2 and 3. Mean cut size by metric and builder",
              {"lights", "metric", "builder", "mean_cut", "deviation", "seeds", "share_of_lights", "error_percent",
               "at_limit", "source"},
              {}};
  for (const PublishedCuts& p : published_cuts()) {
    for (const auto& [lights, cut] : {std::pair{110, p.cut_110}, std::pair{930, p.cut_930}}) {
      table.add({lights, p.metric, "agglomerative", cut, nullptr, 10, cut / lights, nullptr, nullptr, kPublished});
    }
  }
  const std::vector<std::uint64_t>& sizes = study.sizes().cut_lights;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const std::uint64_t n = sizes[i];
    const int count = study.sizes().cut_seeds[i];
    std::vector<Json> seeds;
    study.until_stopped([&] {
      for (int seed = 1; seed <= count; ++seed) {
        Json found = study.measure_if_built(fmt::format("table-2-3/{}/{}", light_count(n), seed),
                                            [&] { return measure_seed(study, n, static_cast<std::uint64_t>(seed)); });
        if (found.is_null()) break;
        seeds.push_back(std::move(found));
        study.show_done((static_cast<double>(i) + static_cast<double>(seed) / count) /
                        static_cast<double>(sizes.size()));
      }
    });
    if (!seeds.empty()) add_rows(study, table, n, seeds);
  }
  study.set("cut_side", study.sizes().cut_side);
  study.add(table);
}

}  // namespace lightcuts::app::study
