#include "bench_study/scenes.h"

#include <fmt/format.h>

#include "scene_source.h"

namespace lightcuts::app::study {

namespace {

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

}  // namespace

void for_each_room(Study& study, const std::function<void(const Room&)>& visit) {
  const std::vector<Room> rooms = rooms_of(study);
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    visit(rooms[i]);
    study.show_done(static_cast<double>(i + 1) / static_cast<double>(rooms.size()));
  }
}

void OpenRoom::open() {
  if (open_) return;
  scene_ = open_scene(room_.spec).scene;
  study_.backend().set_scene(scene_, study_.progress());
  study_.stop_if_asked();
  open_ = true;
}

Image OpenRoom::shade(int side, const ShadeOptions& options, Statistics& statistics) {
  return study_.shade(camera(), side, options, statistics);
}

}  // namespace lightcuts::app::study
