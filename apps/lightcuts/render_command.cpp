#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "interruption.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "progress_bar.h"
#include "render/check_options.h"
#include "render/memory.h"
#include "render/stopwatch.h"
#include "render_request.h"
#include "stats_json.h"
#include "text.h"

namespace lightcuts::app {
namespace {

constexpr const char* kFooter = R"(
Examples:
  lightcuts render builtin:cornell
  lightcuts render room.glb -o room.png --size 640x480 --vpls 20000
  lightcuts render room.glb -o out/room.exr --camera Kitchen --stats out/room.json
  lightcuts render chair.obj --environment 0.8,0.9,1 --eye 2,1.5,3 --target 0,0.5,0
  lightcuts render 'builtin:lamps?count=100000' --quiet

Too slow?  Smaller --size, fewer --vpls; --visibility none for a first look.
Too dark or too bright?  --exposure (of the .png only), --environment 1, --bounces inf.
Bright spots in corners?  More --vpls, a larger --min-distance.
Ctrl-C saves what is done; a second one ends at once.

Exit status: 0 done, 2 wrong usage, 3 input that cannot be used, 4 not enough memory or disk,
5 no such device, 130 interrupted.)";

/// The user's own command with light from outside added.
std::string command_with_environment(const std::vector<std::string>& words) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--environment") {
      ++i;
    } else if (!words[i].starts_with("--environment=")) {
      out += shell_quoted(words[i]) + " ";
    }
  }
  return out + "--environment 1";
}

LoadedScene open_lit_scene(const RenderRequest& request) {
  LoadedScene loaded = open_scene(request.scene);
  if (request.environment) {
    set_environment(loaded, *request.environment);
    for (std::string& warning : validate(loaded.scene)) loaded.warnings.push_back(std::move(warning));
  }
  for (const std::string& warning : loaded.warnings) print_warning(warning);
  if (!emits_light(loaded.scene)) throw Error(Code::no_emitter, "nothing in the scene emits light");
  return loaded;
}

/// Renders, showing progress, until done or asked to stop.
RenderResult render_with_progress(const RenderRequest& request, const Scene& scene, const Camera& camera) {
  ProgressBar bar(!request.quiet);
  bool told = false;
  return render(scene, camera, request.options, [&](const char* stage, double done) {
    bar.show(stage, done);
    if (!Interruption::requested()) return true;
    if (!told && !request.quiet) {
      bar.clear();
      print_note("stopping; what is done will be saved (once more to end at once)");
    }
    told = true;
    return false;
  });
}

void print_summary(const RenderRequest& request, const RenderResult& result) {
  const Statistics& s = result.statistics;
  const bool path = request.options.shade.method == Method::path;
  print_result(fmt::format("{} {}x{} pixels {} in {:.1f} s on {}",
                           result.complete ? "rendered" : "stopped early: part of", result.image.width,
                           result.image.height,
                           path ? "by path tracing" : "with " + grouped(s.vpls.count + s.scene.lights) + " lights",
                           s.time_ms.total / 1000, s.device));
}

/// False for a picture that was stopped before its first sample.
bool holds_samples(const RenderResult& result) {
  if (result.image.pixel_count() == 0) return false;
  const Channel* weight = find_channel(result.image, "weight");
  return result.complete || weight == nullptr ||
         std::any_of(weight->values.begin(), weight->values.end(), [](float w) { return w > 0; });
}

/// Writes pictures and statistics; true if there was anything to write.
bool save(RenderRequest& request, RenderResult& result, const Stopwatch& since_start) {
  if (!holds_samples(result)) return false;
  if (!result.complete) result.image.attributes["complete"] = "false";
  Statistics& statistics = result.statistics;
  statistics.time_ms.total = since_start.ms();
  print_summary(request, result);
  const Stopwatch writing;
  write_pictures(request.outputs, result.image);
  statistics.time_ms.write = writing.ms();
  if (request.outputs.stats.empty()) return true;
  request.options.width = result.image.width;
  request.options.height = result.image.height;
  statistics.time_ms.total = since_start.ms();
  statistics.memory_bytes.host_peak = peak_memory_bytes();
  const std::string json = stats_json(request, statistics);
  if (request.outputs.stats == "-") {
    print_content(json);
  } else {
    save_text(request.outputs.stats, json);
    print_result(fmt::format("wrote {}", request.outputs.stats.string()));
  }
  return true;
}

int run(RenderRequest& request) {
  const Stopwatch since_start;
  check_together(request);
  check_options(request.options);
  prepare(request.outputs, base_name(request.scene), request.options.shade.method);
  std::optional<tbb::global_control> threads;
  if (request.options.threads > 0) {
    threads.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(request.options.threads));
  }
  const LoadedScene loaded = open_lit_scene(request);
  const Camera camera = choose_camera(loaded.scene, request.camera);
  const double load_ms = since_start.ms();

  const Interruption interruption;
  RenderResult result = render_with_progress(request, loaded.scene, camera);
  result.statistics.time_ms.load = load_ms;
  for (const std::string& warning : result.warnings) print_warning(warning);
  if (!save(request, result, since_start)) print_note("interrupted before the first pixel; nothing was written");
  return Interruption::requested() ? kInterrupted : kDone;
}

}  // namespace

void add_render_command(CLI::App& program, const std::vector<std::string>& words, Action& action) {
  CLI::App* command = program.add_subcommand("render", "Render a scene to pictures");
  command->footer(kFooter);
  auto request = std::make_shared<RenderRequest>();
  add_render_options(*command, *request);
  command->callback([request, &words, &action] {
    action = [request, &words] {
      try {
        return run(*request);
      } catch (const Error& error) {
        if (error.code() != Code::no_emitter) throw;
        throw Error(error.code(), fmt::format("{}: {}; light it from outside with\n  {}", request->scene, error.what(),
                                              command_with_environment(words)));
      }
    };
  });
}

}  // namespace lightcuts::app
