#include "bench_study/scenes.h"

#include <fmt/format.h>

#include "scene_source.h"

namespace lightcuts::app::study {

std::vector<Room> rooms_of(Study& study) {
  std::vector<Room> rooms{{"study", "builtin:study"}};
  for (const char* name : {"veach-bidir", "veach-ajar", "modern-hall"}) {
    const std::filesystem::path file = study.request().scenes / name / "scene.gltf";
    if (!study.request().scenes.empty() && std::filesystem::exists(file)) {
      rooms.push_back({name, file.string()});
    } else {
      study.note(
          fmt::format("{}: left out, for there is no {}; --scenes names the folder of the rooms", name, file.string()));
    }
  }
  return rooms;
}

Scene open_room(const Room& room) { return open_scene(room.spec).scene; }

}  // namespace lightcuts::app::study
