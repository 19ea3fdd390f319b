// What cuts cost and how near they come to the sum over all lights, on the CPU. `bench_cut --help` lists the questions;
// docs/results/cut.md holds answers. Times are of shading alone, camera rays included; wall and processor time stand side
// by side, so that a busy machine shows.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "cpu/cpu_backend.h"
#include "lightcuts/compare.h"
#include "lightcuts/io.h"

namespace lightcuts {
namespace {

struct Options {
  std::vector<std::string> scenes{"builtin:study"};
  std::vector<std::uint64_t> vpls{14520};
  std::vector<float> errors{0.02f};
  std::vector<std::string> methods{"all", "packet"};
  std::string visibility = "none";
  int size = 256, heap_size = 0, runs = 1, threads = 0;
  std::uint32_t max_cut = 0;
  int samples = 1;
  int seeds = 1;
  double most_pairs = 2e10;  ///< work that the sum over all lights may take: it gets fewer pixels beyond
  double most_rays = 4e8;
};

struct Measured {
  double wall_us = 0, cpu_us = 0;  ///< a pixel
  int side = 0;
  Statistics statistics;
  Image image;
};

/// A scene with lights and trees.
class Stage {
 public:
  Stage(const std::string& name, std::uint64_t vpls, std::uint64_t seed, int threads)
      : scene_(name.starts_with("builtin:") ? make_builtin_scene(name.substr(8)) : load_scene(name).scene),
        backend_(threads) {
    if (!emits_light(scene_)) scene_.environment = Environment{};
    validate(scene_);
    camera_ = select_camera(scene_, "");
    backend_.set_scene(scene_, {});
    VplOptions options;
    options.count = vpls;
    options.seed = seed;
    backend_.trace_vpls(options, {});
    build(TreeBuilder::ploc, Metric::walter, seed);
  }

  void build(TreeBuilder builder, Metric metric, std::uint64_t seed) {
    backend_.build_light_tree({builder, metric, seed}, {});
  }

  [[nodiscard]] std::size_t light_count() { return backend_.lights().count(); }

  Measured shade(const ShadeOptions& options, int side, int runs) {
    using Clock = std::chrono::steady_clock;
    Measured best;
    best.side = side;
    for (int run = 0; run < runs; ++run) {
      Statistics statistics;
      backend_.forget_maps();
      const Clock::time_point start = Clock::now();
      const std::clock_t cpu_start = std::clock();
      Image image = backend_.shade(camera_, side, side, options, 0, statistics, {}).image;
      const double cpu = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
      const double wall = std::chrono::duration<double>(Clock::now() - start).count();
      const double scale = 1e6 / (static_cast<double>(side) * side);
      if (run == 0 || cpu * scale < best.cpu_us) best.cpu_us = cpu * scale;
      if (run == 0 || wall * scale < best.wall_us) best.wall_us = wall * scale;
      best.statistics = statistics;
      best.image = std::move(image);
    }
    return best;
  }

 private:
  Scene scene_;
  Camera camera_;
  CpuBackend backend_;
};

ShadeOptions shade_options(const Options& options, const std::string& method, float error) {
  ShadeOptions shade;
  shade.visibility = options.visibility == "none"  ? Visibility::none
                     : options.visibility == "ism" ? Visibility::ism
                                                   : Visibility::rays;
  shade.error = error;
  shade.max_cut = options.max_cut;
  shade.samples = options.samples;
  if (method != "all") shade.method = Method::lightcuts;
  if (method == "heap") shade.cut = CutWalk::heap;
  return shade;
}

/// A picture so small that the work stays within bounds.
int side_of(const Options& options, const std::string& method, std::size_t lights) {
  if (method == "heap" && options.heap_size > 0) return options.heap_size;
  if (method != "all") return options.size;
  const double most =
      (options.visibility == "none" ? options.most_pairs : options.most_rays) / static_cast<double>(lights);
  return std::min(options.size, std::max(8, static_cast<int>(std::sqrt(most)) / 8 * 8));
}

void speed(const Options& options) {
  fmt::print(
      "| scene | visibility | lights | method | E | side | wall [us] | processor [us] | cut | largest | rays | pairs "
      "| seed |\n");
  fmt::print("|---|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const std::string& scene : options.scenes) {
    for (const std::uint64_t vpls : options.vpls) {
      for (int seed = 1; seed <= options.seeds; ++seed) {
        Stage stage(scene, vpls, static_cast<std::uint64_t>(seed), options.threads);
        for (const std::string& method : options.methods) {
          for (const float error : options.errors) {
            const int side = side_of(options, method, stage.light_count());
            const Measured m = stage.shade(shade_options(options, method, error), side, options.runs);
            const double pixels = static_cast<double>(side) * side;
            fmt::print("| {} | {} | {} | {} | {} | {} | {:.3f} | {:.3f} | {:.1f} | {} | {:.1f} | {:.1f} | {} |\n",
                       scene, options.visibility, stage.light_count(), method, error, side, m.wall_us, m.cpu_us,
                       m.statistics.cut.mean, m.statistics.cut.max, static_cast<double>(m.statistics.rays) / pixels,
                       static_cast<double>(m.statistics.pairs) / pixels, seed);
            std::fflush(stdout);
          }
        }
      }
    }
  }
}

void errors(const Options& options) {
  fmt::print(
      "scene,visibility,lights,method,seed,error,mean_size,largest,mean_error,p99_error,signed_error,rays,mean_error_r,"
      "mean_error_g,"
      "mean_error_b\n");
  for (const std::string& scene : options.scenes) {
    for (const std::uint64_t vpls : options.vpls) {
      for (int seed = 1; seed <= options.seeds; ++seed) {
        Stage stage(scene, vpls, static_cast<std::uint64_t>(seed), options.threads);
        const Image reference = stage.shade(shade_options(options, "all", 0), options.size, 1).image;
        for (const std::string& method : options.methods) {
          if (method == "all") continue;
          for (const float error : options.errors) {
            const Measured m = stage.shade(shade_options(options, method, error), options.size, 1);
            const Comparison c = compare(m.image, reference);
            fmt::print("{},{},{},{},{},{},{:.1f},{},{:.5f},{:.5f},{:.5f},{:.1f},{:.5f},{:.5f},{:.5f}\n", scene,
                       options.visibility, stage.light_count(), method, seed, error, m.statistics.cut.mean,
                       m.statistics.cut.max, c.mean_relative_error, c.p99_relative_error, c.signed_relative_error,
                       static_cast<double>(m.statistics.rays) / (options.size * options.size),
                       c.channel_relative_error[0], c.channel_relative_error[1], c.channel_relative_error[2]);
            std::fflush(stdout);
          }
        }
      }
    }
  }
}

/// Errors of many draws of the representatives of one set of lights.
void draws(const Options& options) {
  fmt::print(
      "scene,visibility,lights,method,error,draws,mean_size,mean_error,largest_mean_error,p99,largest_p99,signed_mean,"
      "signed_rms,largest_signed\n");
  for (const std::string& scene : options.scenes) {
    for (const std::uint64_t vpls : options.vpls) {
      Stage stage(scene, vpls, 1, options.threads);
      const Image reference = stage.shade(shade_options(options, "all", 0), options.size, 1).image;
      for (const std::string& method : options.methods) {
        if (method == "all") continue;
        for (const float error : options.errors) {
          double size = 0, mean = 0, most = 0, p99 = 0, most99 = 0, sum = 0, sq = 0, largest = 0;
          for (int seed = 1; seed <= options.seeds; ++seed) {
            stage.build(TreeBuilder::ploc, Metric::walter, static_cast<std::uint64_t>(seed));
            const Measured m = stage.shade(shade_options(options, method, error), options.size, 1);
            const Comparison c = compare(m.image, reference);
            size += m.statistics.cut.mean;
            mean += c.mean_relative_error;
            most = std::max(most, c.mean_relative_error);
            p99 += c.p99_relative_error;
            most99 = std::max(most99, c.p99_relative_error);
            sum += c.signed_relative_error;
            sq += c.signed_relative_error * c.signed_relative_error;
            largest = std::max(largest, std::fabs(c.signed_relative_error));
          }
          const double n = options.seeds;
          fmt::print("{},{},{},{},{},{},{:.1f},{:.3f},{:.3f},{:.2f},{:.2f},{:.3f},{:.3f},{:.3f}\n", scene,
                     options.visibility, stage.light_count(), method, error, options.seeds, size / n, 100 * mean / n,
                     100 * most, 100 * p99 / n, 100 * most99, 100 * sum / n, 100 * std::sqrt(sq / n), 100 * largest);
          std::fflush(stdout);
        }
      }
    }
  }
}

/// Mean cuts by builder and metric, over the seeds of lights and tree; then the quotient to the greedy builder's with
/// Walter's metric.
void trees(const Options& options) {
  using enum Metric;
  constexpr std::pair<const char*, Metric> metrics[] = {{"walter", walter},
                                                        {"distance", distance},
                                                        {"distance-color", distance_color},
                                                        {"distance-direction", distance_direction},
                                                        {"distance-color-direction", distance_color_direction}};
  constexpr std::pair<const char*, TreeBuilder> builders[] = {
      {"agglomerative", TreeBuilder::agglomerative}, {"ploc", TreeBuilder::ploc}, {"morton", TreeBuilder::morton}};
  fmt::print("scene,visibility,lights,method,builder,metric,mean_size,to_first\n");
  for (const std::string& scene : options.scenes) {
    for (const std::uint64_t vpls : options.vpls) {
      std::vector<std::unique_ptr<Stage>> stages;
      for (int seed = 1; seed <= options.seeds; ++seed) {
        stages.push_back(std::make_unique<Stage>(scene, vpls, static_cast<std::uint64_t>(seed), options.threads));
      }
      for (const std::string& method : options.methods) {
        if (method == "all") continue;
        const ShadeOptions shade = shade_options(options, method, options.errors.front());
        double first = 0;
        const auto row = [&](const auto& builder, const auto& metric) {
          double size = 0;
          for (std::size_t i = 0; i < stages.size(); ++i) {
            stages[i]->build(builder.second, metric.second, i + 1);
            size += stages[i]->shade(shade, options.size, 1).statistics.cut.mean / static_cast<double>(stages.size());
          }
          if (first == 0) first = size;
          fmt::print("{},{},{},{},{},{},{:.1f},{:.3f}\n", scene, options.visibility, stages[0]->light_count(), method,
                     builder.first, metric.first, size, size / first);
          std::fflush(stdout);
        };
        for (const auto& metric : metrics) row(builders[0], metric);
        for (const auto& builder : builders) row(builder, metrics[0]);
      }
    }
  }
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Measures cuts on the CPU: time a pixel, and error against the sum over all lights");
  app.require_subcommand(1);
  CLI::App* speed_command = app.add_subcommand("speed", "time a pixel of every method");
  CLI::App* errors_command = app.add_subcommand("errors", "error and size by bound, as CSV");
  CLI::App* draws_command =
      app.add_subcommand("draws", "error of many draws of the representatives of the same lights, as CSV, percent");
  CLI::App* trees_command = app.add_subcommand("trees", "mean cut by builder and metric, as CSV");
  for (CLI::App* command : {speed_command, errors_command, draws_command, trees_command}) {
    command->add_option("--scenes", options.scenes, "files, or builtin:NAME");
    command->add_option("--vpls", options.vpls, "numbers of VPLs");
    command->add_option("--errors", options.errors, "bounds");
    command->add_option("--methods", options.methods, "all, packet, heap");
    command->add_option("--visibility", options.visibility, "none, rays, ism");
    command->add_option("--size", options.size, "pixels a side");
    command->add_option("--heap-size", options.heap_size, "the same for the heap");
    command->add_option("--most-pairs", options.most_pairs,
                        "work of `all` without shadows, beyond which it gets fewer pixels");
    command->add_option("--most-rays", options.most_rays, "the same with shadows");
    command->add_option("--runs", options.runs, "the fastest of so many counts");
    command->add_option("--seeds", options.seeds, "of lights and tree");
    command->add_option("--max-cut", options.max_cut, "largest cut");
    command->add_option("--samples", options.samples, "camera samples a pixel");
    command->add_option("--threads", options.threads, "0: all");
  }
  CLI11_PARSE(app, argc, argv);
  (speed_command->parsed()    ? speed
   : errors_command->parsed() ? errors
   : draws_command->parsed()  ? draws
                              : trees)(options);
  return 0;
}

}  // namespace
}  // namespace lightcuts

int main(int argc, char** argv) {
  try {
    return lightcuts::run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
