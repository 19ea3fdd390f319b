// Each method's picture, its error against the path tracer, its cut size.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench_study/rooms.h"
#include "bench_study/scenes.h"
#include "bench_study/study.h"
#include "lightcuts/compare.h"
#include "lightcuts/io.h"

namespace lightcuts::app::study {
namespace {

struct Way {
  const char* name;
  const char* caption;
  Method method;
  Visibility visibility;
};

constexpr Way kWays[] = {{"all-rays", "all lights, rays", Method::instant_radiosity, Visibility::rays},
                         {"cut-rays", "cut, rays", Method::lightcuts, Visibility::rays},
                         {"all-ism", "all lights, shadow maps", Method::instant_radiosity, Visibility::ism},
                         {"cut-ism", "cut, shadow maps", Method::lightcuts, Visibility::ism}};

/// Samples a pixel of the methods without noise: enough for edges.
constexpr int kSamples = 4;
/// Largest mean error of a cut's picture against the sum over the same lights [%].
constexpr double kMostPercent = 6;
/// Where the error pictures' colours end.
constexpr float kMostError = 0.5f;

/// |a - b| / (b + 2 % of the mean), in luminance.
std::vector<float> error_map(const Image& image, const Image& reference) {
  const std::vector<Vec3> a = rgb_pixels(image), b = rgb_pixels(reference);
  double mean = 0;
  for (const Vec3& v : b) mean += luminance(v) / static_cast<double>(b.size());
  std::vector<float> out;
  for (std::size_t i = 0; i < a.size(); ++i) {
    out.push_back(std::abs(luminance(a[i]) - luminance(b[i])) / (luminance(b[i]) + 0.02f * static_cast<float>(mean)));
  }
  return out;
}

/// What one in twenty values is larger than: a few pixels should not make all others dark.
float nearly_largest(std::vector<float> values) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The pictures of one room, from one reference.
class Gallery {
 public:
  Gallery(Study& study, const Room& room) : study_(study), room_(study, room) {}

  void make(Table& table) {
    const Json path = study_.measure(key("path"), [&] { return measure_path(); });
    table.add({room_.name(), "path", side(), samples(), path["wall_s"], nullptr, nullptr, path["cpu_s"], 1, nullptr,
               nullptr, nullptr, nullptr, nullptr, kMeasured});
    show("path", "path tracer, the reference");
    for (const Way& way : kWays) {
      const Json found = study_.measure_if_built(key(way.name), [&] { return measure(way); });
      if (found.is_null()) continue;
      if (way.method == Method::lightcuts) check(way, found);
      table.add({room_.name(), way.caption, side(), kSamples, found["wall_s"], found["low_s"], found["high_s"],
                 found["cpu_s"], found["repeats"], found["relmse"], found["flip"], found["signed_error_percent"],
                 found["off_all_lights_percent"], found["cut"], kMeasured});
      show(way.name, way.caption);
      show(std::string(way.name) + "-error",
           fmt::format("{}: error, yellow {:.0f} % and more", way.caption, 100 * kMostError));
      if (way.method == Method::lightcuts) {
        show(std::string(way.name) + "-size",
             fmt::format("{}: cut size, yellow {} and more", way.caption, found["large"].get<double>()));
      }
    }
  }

 private:
  [[nodiscard]] int side() const { return study_.sizes().picture_side; }
  /// A GPU has the time for a reference with less noise.
  [[nodiscard]] int samples() const { return study_.sizes().picture_samples * (study_.on_cpu() ? 1 : 4); }
  [[nodiscard]] std::string key(const std::string& what) const {
    return fmt::format("pictures/{}/{}", room_.name(), what);
  }
  [[nodiscard]] std::string file(const std::string& what) const {
    return fmt::format("pictures/{}-{}.png", room_.name(), what);
  }
  void show(const std::string& what, const std::string& caption) {
    if (!study_.folder().empty()) study_.add(Picture{room_.name() + "-" + what, file(what), caption});
  }
  void save(const std::string& what, const DisplayImage& image) {
    if (!study_.folder().empty()) save_png(study_.folder() / file(what), image);
  }

  /// Lights are made when the first picture of the room is not there yet.
  void light() {
    room_.open();
    if (lit_) return;
    VplOptions options;
    options.count = study_.sizes().picture_vpls;
    study_.backend().trace_vpls(options, study_.progress());
    study_.stop_if_asked();
    lit_ = true;
  }

  Json measure_path() {
    room_.open();
    Statistics statistics;
    const Stopwatch watch;
    trace(statistics);
    const Time time = stage_time(watch, picture_ms(study_.backend().stage_times()));
    const float exposure = auto_exposure(*reference_);
    save("path", tone_map(*reference_, exposure));
    return {{"wall_s", time.wall_s}, {"cpu_s", time.cpu_s}};
  }
  void trace(Statistics& statistics) {
    ShadeOptions options = shade_options(Method::path, Visibility::rays);
    options.samples = samples();
    reference_ = room_.shade(side(), options, statistics);
  }

  Image shade(const Way& way, Statistics& statistics) {
    statistics = {};
    ShadeOptions options = shade_options(way.method, way.visibility);
    options.samples = kSamples;
    if (way.method == Method::lightcuts) study_.backend().build_light_tree({}, study_.progress());
    return room_.shade(side(), options, statistics);
  }

  /// The sum over all lights that a cut is compared with: the last one made, unless the run was continued in between.
  const Image& all_lights(Visibility visibility) {
    if (!all_lights_ || all_lights_of_ != visibility) {
      Statistics unused;
      keep_all_lights(visibility, shade({"", "", Method::instant_radiosity, visibility}, unused));
    }
    return *all_lights_;
  }
  void keep_all_lights(Visibility visibility, const Image& image) {
    all_lights_ = image;
    all_lights_of_ = visibility;
  }

  /// Where maps leak, cuts leave out what large polygons hide and the sum does not: then they are to be nearer to the truth.
  void check(const Way& way, const Json& found) {
    const double percent = found["off_all_lights_percent"];
    const bool nearer = way.visibility == Visibility::ism && found["nearer"].get<bool>();
    study_.check(fmt::format("picture of {}, {}: error against all lights", room_.name(), way.caption),
                 percent <= kMostPercent || nearer,
                 fmt::format("{:.2f} % (at most {:.0f} %{})", percent, kMostPercent,
                             nearer ? ", or nearer to the path tracer than all lights: it is" : ""));
  }

  Json measure(const Way& way) {
    light();
    Statistics statistics;
    if (!reference_) trace(statistics);  // continued: the picture is there, its floats are not
    Image image;
    Json found = times_of_repeated(study_.sizes().repeats, study_.request().budget_s / 8, [&] {
      study_.backend().forget_maps();
      const Stopwatch watch;
      image = shade(way, statistics);
      const StageTimes device = study_.backend().stage_times();
      const double tree_ms = way.method == Method::lightcuts ? device.tree : 0, shade_ms = picture_ms(device);
      return stage_time(watch, shade_ms > 0 ? tree_ms + shade_ms : 0);
    });
    const Comparison c = compare(image, *reference_);
    found["off_all_lights_percent"] = nullptr;
    if (way.method == Method::instant_radiosity) {
      keep_all_lights(way.visibility, image);
    } else {
      const Image& all = all_lights(way.visibility);
      found["off_all_lights_percent"] = 100 * mean_error(image, all);
      found["nearer"] = c.relmse < compare(all, *reference_).relmse;
    }
    save(way.name, tone_map(image, c.exposure_ev));
    save(std::string(way.name) + "-error",
         false_colour(side(), side(), error_map(image, *reference_), 0, kMostError).picture);
    float large = 0;
    if (const Channel* sizes = find_channel(image, "cut.size")) {
      large = nearly_largest(sizes->values);
      save(std::string(way.name) + "-size", false_colour(side(), side(), sizes->values, 0, large).picture);
    }
    found["relmse"] = c.relmse;
    found["flip"] = c.flip;
    found["signed_error_percent"] = 100 * c.signed_relative_error;
    found["cut"] = way.method == Method::lightcuts ? Json(statistics.cut.mean) : Json(nullptr);
    found["large"] = std::round(large);
    return found;
  }

  Study& study_;
  OpenRoom room_;
  bool lit_ = false;
  std::optional<Image> reference_, all_lights_;
  Visibility all_lights_of_ = Visibility::none;
};

}  // namespace

void make_pictures(Study& study) {
  Table table{"pictures",
              fmt::format("Pictures. {} VPLs, {} samples a pixel, against the path tracer", study.sizes().picture_vpls,
                          kSamples),
              {"room", "method", "side", "samples", "seconds", "low", "high", "cpu_seconds", "repeats", "relmse",
               "flip", "signed_error_percent", "off_all_lights_percent", "mean_cut", "source"},
              {}};
  for_each_room(study, [&](const Room& room) { study.until_stopped([&] { Gallery(study, room).make(table); }); });
  study.add(table);
}

}  // namespace lightcuts::app::study
