// Table 5 and figure 4: Instant Radiosity and cuts over the number of lights, and where they cross.

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "bench_study/agreement.h"
#include "bench_study/published.h"
#include "bench_study/rooms.h"
#include "bench_study/series.h"
#include "bench_study/study.h"

namespace lightcuts::app::study {
namespace {

/// Whether a picture's time includes making its shadow maps, or an earlier picture has made them. A CPU keeps none.
enum class Maps { none, made, kept };

Json maps_json(Maps maps) { return maps == Maps::none ? Json(nullptr) : Json(maps == Maps::made ? "made" : "kept"); }

/// One curve: a method, a visibility and a walk.
struct Curve {
  const char* method;
  const char* visibility;
  Maps maps;
  ShadeOptions options;
  std::uint32_t heap_batch = 0;  ///< pixels at a time, on a GPU

  [[nodiscard]] bool is_cut() const { return options.method == Method::lightcuts; }
  [[nodiscard]] bool same_visibility(const Curve& other) const {
    return options.visibility == other.options.visibility && maps == other.maps;
  }
  [[nodiscard]] std::string name() const {
    return fmt::format("{}, {}{}", method, visibility, maps == Maps::kept ? ", maps made before" : "");
  }
};

std::vector<Curve> curves(bool on_cpu) {
  const auto cut = [](Visibility visibility, CutWalk walk, std::uint32_t max_cut) {
    ShadeOptions options = shade_options(Method::lightcuts, visibility);
    options.cut = walk;
    options.max_cut = max_cut;
    return options;
  };
  const auto sum = [](Visibility visibility) { return shade_options(Method::instant_radiosity, visibility); };
  std::vector<Curve> all;
  for (const Maps maps : {Maps::kept, Maps::made}) {
    if (on_cpu && maps == Maps::kept) continue;
    all.push_back({"all lights", "ism", maps, sum(Visibility::ism)});
    all.push_back({"cut by packet", "ism", maps, cut(Visibility::ism, CutWalk::packet, 0)});
  }
  for (const auto& [name, visibility] : {std::pair{"rays", Visibility::rays}, std::pair{"none", Visibility::none}}) {
    all.push_back({"all lights", name, Maps::none, sum(visibility)});
    all.push_back({"cut by packet", name, Maps::none, cut(visibility, CutWalk::packet, 0)});
  }
  // The study's way. It kept the heaps of so many pixels at once on its GPU; a CPU has one a thread.
  const ShadeOptions heap = cut(Visibility::ism, CutWalk::heap, kStudyMaxCut);
  const ShadeOptions heap_unshadowed = cut(Visibility::none, CutWalk::heap, kStudyMaxCut);
  if (on_cpu) {
    all.push_back({"cut by heap", "ism", Maps::made, heap});
    return all;
  }
  all.push_back({"cut by heap, 4096 threads", "ism", Maps::kept, heap, 4096});
  all.push_back({"cut by heap, 32768 threads", "ism", Maps::kept, heap, 32768});
  all.push_back({"cut by heap, 4096 threads", "none", Maps::none, heap_unshadowed, 4096});
  all.push_back({"cut by heap, 32768 threads", "none", Maps::none, heap_unshadowed, 32768});
  return all;
}

/// Makes lights and trees only where they are not those of the last measurement.
class Lit {
 public:
  explicit Lit(Study& study) : study_(study) {}

  void set_lights(std::uint64_t n) {
    if (n == n_) return;
    Backend& backend = study_.backend();
    if (!loaded_) backend.set_scene(study_room(), study_.progress());
    loaded_ = true;
    n_ = 0;
    has_tree_ = false;
    backend.trace_vpls(study_lights(n), study_.progress());
    study_.stop_if_asked();
    n_ = n;
  }

  void build_tree() {
    if (has_tree_) return;
    study_.backend().build_light_tree({}, study_.progress());
    study_.stop_if_asked();
    has_tree_ = true;
  }

  Image shade(int side, const ShadeOptions& options, Statistics& statistics) {
    return study_.shade(study_room().cameras[0], side, options, statistics);
  }

 private:
  Study& study_;
  bool loaded_ = false, has_tree_ = false;
  std::uint64_t n_ = 0;
};

Json error_percent(const Json& compared) {
  return compared.is_null() ? Json(nullptr) : Json(100 * compared["error"].get<double>());
}

/// Longest picture that is made once before it is timed, though it keeps nothing [s].
constexpr double kWorthWarmingUp = 1;

Json measure_frame(Study& study, Lit& lit, std::uint64_t n, const Curve& curve, double expected_s) {
  const int side = study.sizes().frame_side;
  lit.set_lights(n);
  if (curve.is_cut()) lit.build_tree();
  const Json compared = curve.is_cut() ? compare_cut(study, light_count(n), curve.options) : Json(nullptr);
  Statistics statistics;
  if (curve.heap_batch > 0) study.backend().set_heap_batch(curve.heap_batch);
  // What is kept is made here. Long pictures need no other warm-up than shorter ones before them.
  if (!study.on_cpu() && curve.maps != Maps::made && (curve.maps == Maps::kept || expected_s < kWorthWarmingUp)) {
    lit.shade(side, curve.options, statistics);
  }
  Json found = times_of_repeated(study.sizes().repeats, study.request().budget_s / 4, [&] {
    statistics = {};
    if (curve.maps == Maps::made) study.backend().forget_maps();
    const Stopwatch watch;
    lit.shade(side, curve.options, statistics);
    return stage_time(watch, picture_ms(study.backend().stage_times()));
  });
  found["maps_s"] = statistics.time_ms.shadow_maps / 1000;
  found["maps"] = statistics.shadow_maps.count;
  found["cut"] = curve.is_cut() ? Json(statistics.cut.mean) : Json(nullptr);
  found["at_limit"] = curve.is_cut() ? Json(statistics.cut.at_limit) : Json(nullptr);
  found["pairs"] = statistics.pairs;
  found["rays"] = statistics.rays;
  found["compared"] = compared;
  return found;
}

void add_published(Table& table) {
  for (const PublishedFrame& p : published_frames()) {
    const auto add = [&](const char* method, double seconds) {
      table.add({p.lights, 1000, method, "ism", nullptr, seconds, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
                 nullptr, nullptr, kPublished});
    };
    add("all lights, 4096 threads", p.radiosity_4096);
    add("all lights, 32768 threads", p.radiosity_32768);
    add("cut by heap, 4096 threads", p.lightcuts_4096);
    add("cut by heap, 32768 threads", p.lightcuts_32768);
  }
}

}  // namespace

void make_table_5(Study& study) {
  const int side = study.sizes().frame_side;
  Table table{"table-5",
              "Table 5 and figure 4. Shading a picture: seconds",
              {"lights", "side", "method", "visibility", "maps", "seconds", "low", "high", "cpu_seconds", "repeats",
               "maps_seconds", "mean_cut", "at_limit", "error_percent", "source"},
              {}};
  add_published(table);
  const std::vector<Curve> all = curves(study.on_cpu());
  const std::vector<std::uint64_t>& sizes = study.sizes().frame_lights;
  std::vector<Series> series(all.size());
  Lit lit(study);
  study.until_stopped([&] {
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const std::uint64_t n = sizes[i];
      const auto lights = static_cast<double>(light_count(n));
      for (std::size_t c = 0; c < all.size(); ++c) {
        const Curve& curve = all[c];
        const double expected = series[c].expected(lights);
        Json found;
        if (expected <= study.request().budget_s) {
          study.until_stopped([&] {
            found = study.measure_if_built(fmt::format("table-5/{}/{}", curve.name(), light_count(n)),
                                           [&] { return measure_frame(study, lit, n, curve, expected); });
          });
        }
        if (found.is_null()) {
          if (study.complete())
            study.note(fmt::format("{}, {} lights: left out{}", curve.name(), light_count(n),
                                   std::isfinite(expected) && expected > study.request().budget_s
                                       ? fmt::format(", for it would take about {:.0f} s", expected)
                                       : ""));
          continue;
        }
        check_cut(study, fmt::format("{}, {} lights", curve.name(), light_count(n)), found["compared"]);
        series[c].add(lights, found["wall_s"]);
        table.add({light_count(n), side, curve.method, curve.visibility, maps_json(curve.maps), found["wall_s"],
                   found["low_s"], found["high_s"], found["cpu_s"], found["repeats"], found["maps_s"], found["cut"],
                   found["at_limit"], error_percent(found["compared"]), kMeasured});
        study.show_done((static_cast<double>(i) + static_cast<double>(c + 1) / static_cast<double>(all.size())) /
                        static_cast<double>(sizes.size()));
      }
    }
  });
  Json crossings = Json::array();
  for (std::size_t c = 0; c < all.size(); ++c) {
    if (!all[c].is_cut()) continue;
    for (std::size_t b = 0; b < all.size(); ++b) {
      if (all[b].is_cut() || !all[b].same_visibility(all[c])) continue;
      const std::optional<double> at = crossing(series[b], series[c]);
      crossings.push_back({{"slow", all[b].method},
                           {"fast", all[c].method},
                           {"visibility", all[c].visibility},
                           {"maps", maps_json(all[c].maps)},
                           {"lights", at ? Json(*at) : Json(nullptr)}});
    }
  }
  study.set("crossings", crossings);
  study.add(table);
}

}  // namespace lightcuts::app::study
