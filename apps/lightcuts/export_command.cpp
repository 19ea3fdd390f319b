#include <fmt/format.h>

#include <memory>

#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "io/atomic_file.h"
#include "lightcuts/error.h"
#include "lightcuts/export.h"
#include "options.h"
#include "scene_source.h"

namespace lightcuts::app {
namespace {

constexpr const char* kFooter = R"(
Examples:
  lightcuts export builtin:study study.glb
  lightcuts export room.gltf room.xml        and a folder room/ with its meshes and textures

Exit status: 0 done, 2 wrong usage, 3 input that cannot be used, 4 not enough memory or disk.)";

struct ExportRequest {
  std::string scene, output, camera;
};

int run(const ExportRequest& request) {
  require_writable_place(request.output);
  LoadedScene loaded = open_scene(request.scene);
  for (const std::string& warning : loaded.warnings) print_warning(warning);
  if (!request.camera.empty()) loaded.scene.cameras = {select_camera(loaded.scene, request.camera)};
  for (const std::string& warning : export_scene(request.output, loaded.scene)) print_warning(warning);
  print_result(fmt::format("wrote {}", request.output));
  return kDone;
}

}  // namespace

void add_export_command(CLI::App& program, Action& action) {
  CLI::App* command = program.add_subcommand("export", "Write a scene for another renderer, as this one renders it");
  command->footer(kFooter);
  auto request = std::make_shared<ExportRequest>();
  command->add_option("SCENE", request->scene, kSceneHelp)->required()->option_text(" ");
  command->add_option("OUT", request->output, ".gltf or .glb (glTF 2.0), .xml (Mitsuba 3)")
      ->required()
      ->option_text(" ");
  add_value(
      *command, "--camera", "NAME|INDEX", [request](const std::string& text) { request->camera = text; },
      "the only camera to write (default: all; Mitsuba: the first)");
  command->callback([request, &action] { action = [request] { return run(*request); }; });
}

}  // namespace lightcuts::app
