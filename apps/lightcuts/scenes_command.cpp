#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "lightcuts/scene.h"

namespace lightcuts::app {
namespace {

using Json = nlohmann::ordered_json;

Json scenes_json() {
  Json out = Json::array();
  for (const BuiltinInfo& info : builtin_scenes()) {
    Json keys = Json::array();
    for (const BuiltinKey& key : info.keys) {
      keys.push_back({{"name", key.name}, {"default", key.default_value}, {"meaning", key.meaning}});
    }
    out.push_back({{"name", info.name}, {"summary", info.summary}, {"keys", keys}});
  }
  return out;
}

int run(bool json) {
  if (json) {
    print_result(scenes_json().dump(2));
    return kDone;
  }
  for (const BuiltinInfo& info : builtin_scenes()) {
    print_result(fmt::format("builtin:{:<12} {}", info.name, info.summary));
    for (const BuiltinKey& key : info.keys) {
      print_result(fmt::format("    {:<16} {} (default: {})", key.name, key.meaning, key.default_value));
    }
  }
  return kDone;
}

}  // namespace

void add_scenes_command(CLI::App& program, Action& action) {
  CLI::App* command = program.add_subcommand("scenes", "List the built-in scenes and their keys");
  command->footer(R"(
Example of a scene with keys (quoted, since a shell has its own use for ? and &):
  lightcuts render 'builtin:lamps?count=1000')");
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "a JSON array instead of lines");
  command->callback([json, &action] { action = [json] { return run(*json); }; });
}

}  // namespace lightcuts::app
