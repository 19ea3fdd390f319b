// Table 6 and figure 5: the software versions. "Plain" is one thread and one pixel and light at a time, a heap a pixel;
// "SIMD" is what the renderer does.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <optional>

#include "bench_study/published.h"
#include "bench_study/rooms.h"
#include "bench_study/scalar_gold.h"
#include "bench_study/series.h"
#include "bench_study/study.h"
#include "lightcuts/compare.h"

namespace lightcuts::app::study {
namespace {

enum class Version { plain_sum, plain_cut, simd_sum, simd_cut, all_sum, all_cut };

struct Curve {
  Version version;
  const char* method;
  const char* how;
};

constexpr Curve kCurves[] = {
    {Version::plain_sum, "all lights", "plain, 1 thread"}, {Version::plain_cut, "cut by heap", "plain, 1 thread"},
    {Version::simd_sum, "all lights", "SIMD, 1 thread"},   {Version::simd_cut, "cut by packet", "SIMD, 1 thread"},
    {Version::all_sum, "all lights", "SIMD, all threads"}, {Version::all_cut, "cut by packet", "SIMD, all threads"}};

/// The backends and the plain renderer over the same lights.
class Software {
 public:
  explicit Software(Study& study)
      : study_(study),
        one_(make_cpu_backend(1)),
        all_(make_cpu_backend(study.request().threads)),
        plain_(study_room()) {
    one_->set_scene(study_room(), {});
    all_->set_scene(study_room(), {});
  }

  void set(std::uint64_t n) {
    if (n == n_) return;
    n_ = 0;
    all_->trace_vpls(study_lights(n), study_.progress());
    all_->build_light_tree({}, study_.progress());
    study_.stop_if_asked();
    one_->set_lights(all_->lights());
    one_->set_light_tree(all_->light_trees());
    n_ = n;
  }

  Image render(Version version, int side, Statistics& statistics) {
    const Camera& camera = study_room().cameras[0];
    Image image;
    if (version == Version::plain_sum) {
      image = plain_.render(all_->lights(), camera, side, side, study_.progress());
    } else {
      const bool sum = version == Version::simd_sum || version == Version::all_sum;
      ShadeOptions options = shade_options(sum ? Method::instant_radiosity : Method::lightcuts, Visibility::rays);
      if (version == Version::plain_cut) options.cut = CutWalk::heap;
      Backend& backend = version == Version::all_sum || version == Version::all_cut ? *all_ : *one_;
      image = backend.shade(camera, side, side, options, memory_budget(), statistics, study_.progress()).image;
    }
    study_.stop_if_asked();
    return image;
  }

 private:
  Study& study_;
  std::unique_ptr<Backend> one_, all_;
  ScalarRadiosity plain_;
  std::uint64_t n_ = 0;
};

/// Pixels a side of the study's pictures.
constexpr int kStudySoftwareSide = 50;
/// Pixels a side of the pictures that are compared before anything is timed.
constexpr int kCheckSide = 16;

Json measure_picture(Study& study, Software& software, std::uint64_t n, int side, const Curve& curve) {
  software.set(n);
  Statistics statistics;
  const Image reference = software.render(Version::all_sum, kCheckSide, statistics);
  const double error = mean_error(software.render(curve.version, kCheckSide, statistics), reference);
  Json found = time_repeatedly(study.sizes().repeats, study.request().budget_s / 4, [&] {
    statistics = {};
    software.render(curve.version, side, statistics);
  });
  found["cut"] = statistics.cut.mean > 0 ? Json(statistics.cut.mean) : Json(nullptr);
  found["error"] = error;
  return found;
}

/// Cuts may be off by what they promise; sums over all lights only by rounding.
double allowed_error(const Curve& curve) { return std::string(curve.method) == "all lights" ? 1e-4 : 0.05; }

}  // namespace

void make_table_6(Study& study) {
  Table table{"table-6",
              "Table 6 and figure 5. The software versions, shadow rays: seconds",
              {"lights", "side", "method", "how", "seconds", "low", "high", "cpu_seconds", "repeats", "mean_cut",
               "error_percent", "source"},
              {}};
  for (const PublishedSoftware& p : published_software()) {
    table.add({p.lights, 50, "all lights", "study", p.radiosity, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
               kPublished});
    table.add({p.lights, 50, "cut by heap", "study", p.lightcuts, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
               kPublished});
  }
  Software software(study);
  Json ratios = Json::array();
  const Sizes& sizes = study.sizes();
  double done = 0;
  std::vector<Series> before;
  int side_before = 0;
  // They are the CPU's; in a GPU's run they stand beside its times, at the study's size.
  std::vector<int> sides = sizes.software_sides;
  if (!study.on_cpu() && sides.size() > 1) {
    sides.erase(sides.begin() + 1, sides.end());
    study.note("table 6, larger pictures: the software versions are a CPU's; its own run (--backend cpu) has them");
  }
  for (const int side : sides) {
    std::vector<Series> series(std::size(kCurves));
    study.until_stopped([&] {
      for (const std::uint64_t n : sizes.software_lights) {
        for (std::size_t c = 0; c < std::size(kCurves); ++c) {
          const Curve& curve = kCurves[c];
          const std::string name =
              fmt::format("{}, {}, {} lights, {}x{}", curve.method, curve.how, light_count(n), side, side);
          const double lights = static_cast<double>(light_count(n));
          const double pixels = side_before == 0 ? 0 : std::pow(static_cast<double>(side) / side_before, 2);
          const double expected = !series[c].lights().empty() || before.empty() ? series[c].expected(lights)
                                  : before[c].at(lights)                        ? pixels * *before[c].at(lights)
                                                         : std::numeric_limits<double>::infinity();
          const bool published = side == kStudySoftwareSide && sizes.all_published && study.on_cpu();
          if (expected > study.request().budget_s && !published) {
            study.note(name + ": left out, for it would take " +
                       (std::isfinite(expected) ? fmt::format("about {:.0f} s", expected) : std::string("too long")));
            continue;
          }
          const Json found =
              study.measure("table-6/" + name, [&] { return measure_picture(study, software, n, side, curve); });
          const double error = found["error"];
          study.check(name + ": error against all lights", error <= allowed_error(curve),
                      fmt::format("{:.4f} % (at most {:.2f} %)", 100 * error, 100 * allowed_error(curve)));
          series[c].add(static_cast<double>(light_count(n)), found["wall_s"]);
          table.add({light_count(n), side, curve.method, curve.how, found["wall_s"], found["low_s"], found["high_s"],
                     found["cpu_s"], found["repeats"], found["cut"], 100 * error, kMeasured});
        }
        done += 1.0 / static_cast<double>(sides.size() * sizes.software_lights.size());
        study.show_done(done);
      }
    });
    for (std::size_t c = 0; c < std::size(kCurves); c += 2) {
      if (series[c].lights().empty()) continue;
      const double lights = series[c].lights().back();
      const std::optional<double> cut = series[c + 1].at(lights);
      if (!cut) continue;
      ratios.push_back(
          {{"side", side}, {"how", kCurves[c].how}, {"lights", lights}, {"ratio", series[c].seconds().back() / *cut}});
    }
    before = std::move(series);
    side_before = side;
  }
  study.set("software_ratios", ratios);
  study.add(table);
}

}  // namespace lightcuts::app::study
