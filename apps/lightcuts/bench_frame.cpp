#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>

#include "backend/backend.h"
#include "bench.h"
#include "console.h"
#include "interruption.h"
#include "lightcuts/compare.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "scene_source.h"

namespace lightcuts::app {
namespace {

// Times are the device's where the backend measures them (CUDA events), else of the whole call. Each is the median of
// many runs after a warm-up; what is timed is first compared with the sum over all lights.

constexpr float kMinDistance = 0.0133f;  ///< fraction of the scene's diagonal, as the goals say
constexpr int kWarmUp = 2;

struct Sizes {
  int side;  ///< of the picture [pixels]
  int runs;
  std::vector<std::uint64_t> vpls;
  std::vector<std::uint64_t> study_lights;  ///< the study's numbers, for heap and brute force
  std::vector<std::uint64_t> more_lights;   ///< between and beyond, for curves
  double longest_s;                         ///< runs of one measurement end after this
};

Sizes sizes_of(BenchScale scale) {
  switch (scale) {
    case BenchScale::smoke:
      return {32, 1, {200}, {110}, {300}, 1};
    case BenchScale::quick:
      return {200, 3, {2550, 65536}, {110, 2550}, {}, 2};
    case BenchScale::small:
      return {500, 5, {2550, 65536}, {110, 420, 930, 2550}, {16384}, 5};
    case BenchScale::medium:
    case BenchScale::full:
      break;
  }
  return {1000, 20, {2550, 65536, 1048576}, {110, 420, 930, 2550}, {16384, 65536, 262144, 1048576, 4194304}, 4};
}

/// What issue 6 of the project asks of one H100 at 1000x1000 [ms]; 0: nothing.
double goal_ms(const std::string& scene, const std::string& stage, std::uint64_t vpls) {
  const bool million = vpls == 1048576;
  if (stage == "light tree") return million ? 3 : 0;
  if (stage == "vpls") return million && scene == "veach-ajar" ? 5 : 0;
  if (stage == "packet, none") return million ? 4 : 0;
  if (stage == "packet, rays") return !million ? 0 : scene == "study" ? 200 : 350;
  if (stage == "packet, ism") return vpls == 2550 ? 2.5 : vpls == 65536 ? 6 : million ? 8 : 0;
  if (stage == "everything, ism") return million ? 33 : 0;
  if (stage == "all lights, none") return vpls == 2550 ? 2.55 : 0;
  if (stage == "all lights, ism") return vpls == 2550 ? 5 : 0;
  return 0;
}

class FrameBench {
 public:
  explicit FrameBench(const BenchRequest& request)
      : request_(request), sizes_(sizes_of(request.scale)), backend_(make_bench_backend(request)) {
    result_.json["machine"] = machine_json(backend_->device_name());
    result_.json["side_px"] = sizes_.side;
    result_.json["min_distance"] = kMinDistance;
    result_.json["rows"] = nlohmann::ordered_json::array();
  }

  BenchResult run() {
    print_result(fmt::format("{}, {}x{} pixels, error 0.02, min-distance {}", backend_->device_name(), sizes_.side,
                             sizes_.side, kMinDistance));
    print_result(fmt::format("{:<12} {:>8} {:<22} {:>10} {:>18} {:>8}  {}", "scene", "VPLs", "stage", "median ms",
                             "lowest..highest", "goal ms", "what was counted"));
    measure_scene("study", "builtin:study");
    const std::filesystem::path rooms = request_.scenes.empty() ? "../shared/scenes/rooms" : request_.scenes;
    const std::filesystem::path ajar = rooms / "veach-ajar" / "scene.gltf";
    if (std::filesystem::exists(ajar)) {
      measure_scene("veach-ajar", ajar.string());
    } else {
      print_note("veach-ajar is not in " + rooms.string() + ": left out");
    }
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool stopped() {
    if (Interruption::requested()) result_.complete = false;
    return !result_.complete;
  }

  enum class PartKind { scene, lights, stage };
  /// Of --part, the names of scenes, numbers of lights, or parts of stages' names.
  [[nodiscard]] std::vector<std::string> parts_that(PartKind name) const {
    std::vector<std::string> parts;
    for (const std::string& part : request_.parts) {
      const bool number = part.find_first_not_of("0123456789") == std::string::npos;
      const PartKind kind = part == "study" || part == "veach-ajar" ? PartKind::scene
                            : number                                ? PartKind::lights
                                                                    : PartKind::stage;
      if (kind == name) parts.push_back(part);
    }
    return parts;
  }
  [[nodiscard]] bool lights_wanted(std::uint64_t vpls) const {
    const std::vector<std::string> numbers = parts_that(PartKind::lights);
    return numbers.empty() || std::find(numbers.begin(), numbers.end(), std::to_string(vpls)) != numbers.end();
  }
  static bool wanted(const std::vector<std::string>& parts, const std::string& name) {
    return parts.empty() || std::any_of(parts.begin(), parts.end(),
                                        [&](const std::string& part) { return name.find(part) != std::string::npos; });
  }

  void measure_scene(const std::string& name, const std::string& spec) {
    if (stopped() || !wanted(parts_that(PartKind::scene), name)) return;
    name_ = name;
    Scene scene = open_scene(spec).scene;
    camera_ = select_camera(scene, "");
    backend_->set_scene(scene, {});
    for (const std::uint64_t vpls : sizes_.vpls) measure_stages(vpls);
    for (const std::uint64_t vpls : sizes_.study_lights) measure_as_the_study(vpls);
    for (const std::uint64_t vpls : sizes_.more_lights) measure_curve(vpls);
  }

  ShadeOptions options(Method method, Visibility visibility) const {
    ShadeOptions o;
    o.method = method;
    o.visibility = visibility;
    o.min_distance = kMinDistance;
    o.ism_size = 32;
    o.ism_points = 2000;
    return o;
  }

  void trace(std::uint64_t vpls) {
    VplOptions o;
    o.count = vpls;
    backend_->trace_vpls(o, {});
  }

  void measure_stages(std::uint64_t vpls) {
    if (stopped() || !lights_wanted(vpls)) return;
    vpls_ = vpls;
    time(
        "vpls", [&] { trace(vpls); }, [](const StageTimes& t) { return t.vpls; });
    time(
        "light tree", [&] { backend_->build_light_tree({}, {}); }, [](const StageTimes& t) { return t.tree; });
    check_cut();
    shade("packet, none", options(Method::lightcuts, Visibility::none));
    shade("packet, rays", options(Method::lightcuts, Visibility::rays));
    const ShadeOptions by_maps = options(Method::lightcuts, Visibility::ism);
    shade("packet, ism", by_maps);
    shade("packet, ism, maps too", by_maps, Again::maps);
    shade("everything, ism", by_maps, Again::everything);
    if (vpls <= 65536) shade("all lights, none", options(Method::instant_radiosity, Visibility::none));
    if (vpls <= 2550) {
      shade("all lights, rays", options(Method::instant_radiosity, Visibility::rays));
      shade("all lights, ism", options(Method::instant_radiosity, Visibility::ism));
    }
  }

  /// The study's numbers of lights, its way of cutting, and its limit on the cut.
  void measure_as_the_study(std::uint64_t vpls) {
    if (stopped() || !lights_wanted(vpls)) return;
    vpls_ = vpls;
    trace(vpls);
    backend_->build_light_tree({}, {});
    shade("all lights, none", options(Method::instant_radiosity, Visibility::none));
    shade("packet, none", options(Method::lightcuts, Visibility::none));
    shade("all lights, ism", options(Method::instant_radiosity, Visibility::ism));
    shade("packet, ism", options(Method::lightcuts, Visibility::ism));
    ShadeOptions heap = options(Method::lightcuts, Visibility::none);
    heap.cut = CutWalk::heap;
    heap.max_cut = 1000;
    for (const std::uint32_t batch : {4096u, 32768u}) {
      backend_->set_heap_batch(batch);
      shade(fmt::format("heap, none, {}", batch), heap);
    }
  }

  /// What packets, heaps and all lights cost, and the tree; all lights up to a quarter of a million, for they grow evenly.
  void measure_curve(std::uint64_t vpls) {
    if (stopped() || !lights_wanted(vpls)) return;
    vpls_ = vpls;
    trace(vpls);
    time(
        "light tree", [&] { backend_->build_light_tree({}, {}); }, [](const StageTimes& t) { return t.tree; });
    shade("packet, none", options(Method::lightcuts, Visibility::none));
    if (vpls <= 262144) shade("all lights, none", options(Method::instant_radiosity, Visibility::none));
    ShadeOptions heap = options(Method::lightcuts, Visibility::none);
    heap.cut = CutWalk::heap;
    heap.max_cut = 1000;
    backend_->set_heap_batch(32768);
    shade("heap, none, 32768", heap);
  }

  /// The cut's picture, small, against the sum over all lights; with maps, which let light through walls that cuts leave out,
  /// against a cut of a twentieth of the error.
  void check_cut() {
    constexpr int side = 64;
    for (const Visibility visibility : {Visibility::none, Visibility::ism}) {
      const auto picture = [&](const ShadeOptions& o) {
        Statistics s;
        return backend_->shade(camera_, side, side, o, 0, s, {}).image;
      };
      ShadeOptions exact = options(Method::instant_radiosity, visibility);
      if (visibility == Visibility::ism) {
        exact = options(Method::lightcuts, visibility);
        exact.error /= 20;
      }
      const Comparison c = compare(picture(options(Method::lightcuts, visibility)), picture(exact));
      const bool good = c.mean_relative_error < 0.02;
      result_.correct = result_.correct && good;
      print_result(fmt::format(
          "{:<12} {:>8} {:<22} mean error {:.2f} %, 99th percentile {:.2f} %, signed {:.2f} %{}", name_, vpls_,
          visibility == Visibility::ism ? "check of the cut, ism" : "check of the cut", 100 * c.mean_relative_error,
          100 * c.p99_relative_error, 100 * c.signed_relative_error, good ? "" : "  WRONG"));
    }
  }

  /// What is made anew for every run; else the maps of the run before serve.
  enum class Again { pixels, maps, everything };

  void shade(const std::string& stage, const ShadeOptions& o, Again again = Again::pixels) {
    if (stopped() || !wanted(parts_that(PartKind::stage), stage)) return;
    Statistics s;
    const auto run = [&] {
      s = {};
      if (again != Again::pixels) backend_->forget_maps();
      if (again == Again::everything) {
        trace(vpls_);
        backend_->build_light_tree({}, {});
      }
      backend_->shade(camera_, sizes_.side, sizes_.side, o, 0, s, {});
    };
    const auto device_time = [again](const StageTimes& t) {
      if (again == Again::everything) return t.vpls + t.tree + t.points + t.shade;
      return again == Again::maps ? t.points + t.light : t.light;
    };
    try {
      time(stage, run, device_time, &s);
    } catch (const Error& error) {
      if (error.code() != Code::not_built) throw;
      print_result(fmt::format("{:<12} {:>8} {:<22} {}", name_, vpls_, stage, "not part of this backend yet"));
    }
  }

  void time(const std::string& stage, const std::function<void()>& run,
            const std::function<double(const StageTimes&)>& device_time, const Statistics* statistics = nullptr) {
    using Clock = std::chrono::steady_clock;
    std::vector<double> times;
    const auto start = Clock::now();
    for (int k = -kWarmUp; k < sizes_.runs && !stopped(); ++k) {
      const auto before = Clock::now();
      run();
      const double wall = std::chrono::duration<double, std::milli>(Clock::now() - before).count();
      const double device = device_time(backend_->stage_times());
      if (k >= 0 || sizes_.runs == 1) times.push_back(device > 0 ? device : wall);
      const double spent = std::chrono::duration<double>(Clock::now() - start).count();
      if (spent > sizes_.longest_s && !times.empty()) break;
    }
    add_row(stage, summarise(times), statistics);
  }

  void add_row(const std::string& stage, const Repeats& r, const Statistics* s) {
    const double goal = goal_ms(name_, stage, vpls_);
    std::string counted;
    nlohmann::ordered_json row{{"scene", name_},  {"vpls", vpls_},     {"stage", stage}, {"median_ms", r.median},
                               {"low_ms", r.low}, {"high_ms", r.high}, {"runs", r.count}};
    if (goal > 0) row["goal_ms"] = goal;
    if (s != nullptr) {
      row["cut_mean"] = s->cut.mean;
      row["pairs"] = s->pairs;
      row["rays"] = s->rays;
      row["lights_used"] = s->cut.lights_used;
      row["shadow_maps"] = s->shadow_maps.count;
      row["rounds"] = s->shadow_maps.rounds;
      row["device_peak_bytes"] = s->memory_bytes.device_peak;
      counted = fmt::format(
          "{}{:.2f} T pairs/s{}{}, peak {:.0f} MB",
          s->cut.mean > 0 ? fmt::format("cut {:.0f}, {} lights, ", s->cut.mean, s->cut.lights_used) : std::string(),
          static_cast<double>(s->pairs) / r.median / 1e9,
          s->rays > 0 ? fmt::format(", {:.2f} G rays/s", static_cast<double>(s->rays) / r.median / 1e6) : std::string(),
          s->shadow_maps.count > 0 ? fmt::format(", {} maps in {} rounds", s->shadow_maps.count, s->shadow_maps.rounds)
                                   : std::string(),
          static_cast<double>(s->memory_bytes.device_peak) / 1e6);
    }
    result_.json["rows"].push_back(std::move(row));
    print_result(fmt::format("{:<12} {:>8} {:<22} {:>10.3f} {:>8.3f}..{:<8.3f} {:>8}  {}", name_, vpls_, stage,
                             r.median, r.low, r.high, goal > 0 ? fmt::format("{:g}", goal) : "-", counted));
  }

  const BenchRequest& request_;
  Sizes sizes_;
  std::unique_ptr<Backend> backend_;
  BenchResult result_;
  std::string name_;
  Camera camera_;
  std::uint64_t vpls_ = 0;
};

}  // namespace

BenchResult run_frame(const BenchRequest& request) {
  const Interruption interruption;
  return FrameBench(request).run();
}

}  // namespace lightcuts::app
