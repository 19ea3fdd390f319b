// What imperfect shadow maps are worth against rays, and what they cost. `bench_ism --help` lists the questions;
// docs/results/ism.md holds answers.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "measurements.h"

namespace lightcuts {
namespace {

struct Options {
  std::vector<std::string> scenes{"study"};
  std::uint64_t vpls = 2000;
  Sweep sweep;
  std::vector<int> texels;
  std::vector<std::uint32_t> points;
  std::uint32_t light = 0;
  std::string output;
};

/// Runs a part for every scene.
void for_each_scene(const Options& options, const std::function<void(const BenchScene&)>& part) {
  for (const std::string& name : options.scenes) part(BenchScene(name, options.vpls));
}

class Command {
 public:
  Command() : app_("What shadow maps are worth against shadow rays, and what they cost. Prints tables.") {
    app_.require_subcommand(1);
    app_.footer(
        "Scenes are names of built-in ones (study, cornell, interior, ...) or files. Example:\n"
        "  bench_ism agreement study scenes/veach-ajar/scene.gltf --texels 64 --points 8000");
  }

  /// A table of a sweep over texels and points.
  void add_sweep(const char* name, const char* help, std::uint64_t vpls, std::size_t step, std::vector<int> texels,
                 std::vector<std::uint32_t> points, void (*heading)(),
                 void (*measure)(const BenchScene&, const Sweep&)) {
    CLI::App* command = add(name, help, vpls, [=](const Options& o) {
      heading();
      const Sweep sweep{o.texels.empty() ? texels : o.texels, o.points.empty() ? points : o.points, step};
      for_each_scene(o, [&](const BenchScene& bench) { measure(bench, sweep); });
    });
    command->add_option("--texels", options_.texels, "sizes of maps (a side)");
    add_points(command);
  }

  void add_points(CLI::App* command) { command->add_option("--points", options_.points, "numbers of points a map"); }

  /// A table of sizes.
  void add_sizes(const char* name, const char* help, std::uint64_t vpls, std::vector<int> texels, void (*heading)(),
                 void (*measure)(const BenchScene&, int)) {
    CLI::App* command = add(name, help, vpls, [=](const Options& o) {
      heading();
      for_each_scene(o, [&](const BenchScene& bench) {
        for (const int size : o.texels.empty() ? texels : o.texels) measure(bench, size);
      });
    });
    command->add_option("--texels", options_.texels, "sizes of maps (a side)");
  }

  CLI::App* add(const char* name, const char* help, std::uint64_t vpls, std::function<void(const Options&)> run) {
    CLI::App* command = app_.add_subcommand(name, help);
    command->add_option("scenes", options_.scenes, "built-in names or files; study where none is given");
    command->add_option("--vpls", options_.vpls, fmt::format("number of VPLs; {} where not given", vpls));
    command->callback([this, command, vpls, run = std::move(run)] {
      if (command->count("--vpls") == 0) options_.vpls = vpls;
      run(options_);
    });
    return command;
  }

  /// A part that brings its own scene.
  void add_contact() {
    CLI::App* command =
        app_.add_subcommand("contact", "light close to where a box stands on a floor, by each rule of a lookup");
    command->add_option("--texels", options_.texels, "sizes of maps (a side)");
    command->callback([this] {
      print_contact_heading();
      for (const int size : options_.texels.empty() ? std::vector{16, 32, 64, 128} : options_.texels) {
        measure_contact_shadows(size);
      }
    });
  }

  void add_map() {
    CLI::App* command =
        add("map", "draw a VPL's map before and after pull-push, in false colour", 2000, [](const Options& o) {
          for_each_scene(o, [&](const BenchScene& bench) { draw_map_picture(bench, o.light, o.output); });
        });
    command->add_option("--light", options_.light, "which VPL");
    command->add_option("-o,--output", options_.output, "the PNG file")->required();
  }

  int run(int argc, char** argv) {
    CLI11_PARSE(app_, argc, argv);
    return 0;
  }

 private:
  CLI::App app_;
  Options options_;
};

int run(int argc, char** argv) {
  Command command;
  command.add_sweep("agreement", "random pairs of a light and a place: how often maps say what a ray says", 2000, 20,
                    {32, 64, 128}, {1000, 8000, 64000}, print_agreement_heading, measure_agreement);
  command.add_sweep("lit", "places that a light reaches with no shadow's edge near: how much arrives", 2000, 10,
                    {16, 32, 64, 128, 256}, {8000, 64000}, print_lit_heading, measure_lit);
  command.add_sweep("pictures", "128x128 pixels by the sum over all lights: relmse and FLIP against rays", 1000, 1,
                    {32, 64, 128}, {1000, 8000, 64000}, print_pictures_heading, compare_pictures);
  const auto per_scene = [](void (*measure)(const BenchScene&)) {
    return [measure](const Options& o) { for_each_scene(o, measure); };
  };
  command.add("speed", "what a map costs in shadow rays, on one thread", 2000, per_scene(measure_speed));
  command.add("scaling", "what a map costs by texels, points and the number of maps, on one thread", 2000,
              per_scene(measure_scaling));
  command.add_sizes("rules", "pairs and lit places by other rules of a lookup", 2000, {16, 32, 64, 128},
                    print_rules_heading, compare_lookup_rules);
  command.add_sizes("rule-pictures", "pictures by other rules of a lookup", 1000, {16, 64}, print_rule_pictures_heading,
                    compare_pictures_by_rules);
  command.add_contact();
  CLI::App* adaptive =
      command.add("adaptive", "more of a map's points where its light sees more", 1000, [](const Options& o) {
        print_adaptive_heading();
        for_each_scene(o, [&](const BenchScene& bench) {
          for (const std::uint32_t points : o.points.empty() ? std::vector<std::uint32_t>{2000, 8000} : o.points) {
            compare_adaptive_points(bench, points);
          }
        });
      });
  command.add_points(adaptive);
  command.add_map();
  return command.run(argc, argv);
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
