// What the study could not do: error against time, for every method on the same rooms.

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "bench_study/references.h"
#include "bench_study/rooms.h"
#include "bench_study/scenes.h"
#include "bench_study/study.h"

namespace lightcuts::app::study {
namespace {

struct Way {
  const char* name;
  Method method;
  Visibility visibility;
};

constexpr Way kWays[] = {{"all lights, rays", Method::instant_radiosity, Visibility::rays},
                         {"cut, rays", Method::lightcuts, Visibility::rays},
                         {"cut, shadow maps", Method::lightcuts, Visibility::ism}};

/// A GPU has the time for references with less noise.
constexpr int kMoreOnGpu = 8;

/// The methods on one room. Errors are free of the references' noise: see references.h.
class Race {
 public:
  Race(Study& study, const Room& room) : study_(study), room_(study, room) {}

  void run(Table& table) {
    for (const Way& way : kWays) study_.until_stopped([&] { run_way(way, table); });
    study_.until_stopped([&] { run_paths(table); });
  }

 private:
  void run_way(const Way& way, Table& table) {
    double last_s = 0, last_count = 0;
    for (const std::uint64_t count : study_.sizes().converge_vpls) {
      const double expected = last_s * static_cast<double>(count) / std::max(1.0, last_count);
      if (way.method == Method::instant_radiosity && expected > study_.request().budget_s) break;
      const Json found = study_.measure_if_built(key(way.name, count), [&] { return measure(way, count); });
      if (found.is_null()) break;
      last_s = found["wall_s"];
      last_count = static_cast<double>(count);
      add(table, way.name, count, found);
    }
  }

  void run_paths(Table& table) {
    for (const int samples : study_.sizes().converge_paths) {
      const auto count = static_cast<std::uint64_t>(samples);
      const Json found = study_.measure(key("path", count), [&] { return measure_path(samples); });
      add(table, "path tracer", count, found);
    }
  }

  [[nodiscard]] int side() const { return study_.sizes().converge_side; }
  [[nodiscard]] std::string key(const char* way, std::uint64_t n) const {
    return fmt::format("convergence/{}/{}/{}", room_.name(), way, n);
  }
  void add(Table& table, const char* way, std::uint64_t n, const Json& found) {
    table.add({room_.name(), way, n, side(), found["wall_s"], found["low_s"], found["high_s"], found["cpu_s"],
               found["repeats"], found["relmse"], found["standard_error"], kMeasured});
  }

  Image shade(const ShadeOptions& options) {
    Statistics unused;
    return room_.shade(side(), options, unused);
  }

  /// Everything that the picture takes, from the light paths on.
  Json measure(const Way& way, std::uint64_t count) {
    room_.open();
    if (!centres_) {
      centres_ = trace_centres(room_.scene(), room_.camera(), side(), half_samples(), study_.progress());
      study_.stop_if_asked();
    }
    VplOptions vpls;
    vpls.count = count;
    Image image;
    Json found = repeated([&] {
      study_.backend().forget_maps();
      const Stopwatch watch;
      study_.backend().trace_vpls(vpls, study_.progress());
      if (way.method == Method::lightcuts) study_.backend().build_light_tree({}, study_.progress());
      image = shade(shade_options(way.method, way.visibility));
      const StageTimes device = study_.backend().stage_times();
      const double tree_ms = way.method == Method::lightcuts ? device.tree : 0;
      const double shade_ms = picture_ms(device);
      return stage_time(watch, shade_ms > 0 ? device.vpls + tree_ms + shade_ms : 0);
    });
    return with_error(std::move(found), image, *centres_);
  }

  Json measure_path(int samples) {
    room_.open();
    if (!pixels_) {
      pixels_.emplace();
      for (Image* half : {&pixels_->first, &pixels_->second}) {
        ShadeOptions options = shade_options(Method::path, Visibility::rays);
        options.samples = static_cast<int>(half_samples()) * (study_.on_cpu() ? 1 : kMoreOnGpu);
        options.seed = half == &pixels_->first ? 101 : 102;
        *half = shade(options);
      }
    }
    ShadeOptions options = shade_options(Method::path, Visibility::rays);
    options.samples = samples;
    Image image;
    Json found = repeated([&] {
      const Stopwatch watch;
      image = shade(options);
      return stage_time(watch, picture_ms(study_.backend().stage_times()));
    });
    return with_error(std::move(found), image, *pixels_);
  }

  static Json with_error(Json found, const Image& image, const Halves& reference) {
    const Estimate relmse = relmse_without_noise(image, reference);
    found["relmse"] = relmse.value;
    found["standard_error"] = relmse.standard_error;
    return found;
  }

  /// Many pictures are made here, so each is repeated for a short time only.
  template <class Work>
  Json repeated(const Work& work) {
    return times_of_repeated(study_.sizes().repeats, study_.request().budget_s / 12, work);
  }
  [[nodiscard]] std::uint32_t half_samples() const {
    return static_cast<std::uint32_t>(study_.sizes().converge_samples / 2);
  }

  Study& study_;
  OpenRoom room_;
  std::optional<Halves> centres_;  ///< what one sample a pixel through its centre should be
  std::optional<Halves> pixels_;   ///< what the mean over a pixel should be
};

}  // namespace

void make_convergence(Study& study) {
  Table table{"convergence",
              "Error against time: relMSE without the reference's noise; seconds from the light paths on",
              {"room", "method", "vpls_or_paths", "side", "seconds", "low", "high", "cpu_seconds", "repeats", "relmse",
               "standard_error", "source"},
              {}};
  for_each_room(study, [&](const Room& room) { study.until_stopped([&] { Race(study, room).run(table); }); });
  study.add(table);
}

}  // namespace lightcuts::app::study
