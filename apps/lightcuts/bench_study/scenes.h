#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench_study/study.h"

namespace lightcuts::app::study {

/// A scene of the pictures, or why it is not there.
struct Room {
  std::string name;
  std::string spec;  ///< as the command line names it
};

/// Calls `visit` for the study's room and for those of `veach-bidir`, `veach-ajar` and `modern-hall` that the scenes' folder
/// has, and shows how many are done; a missing one is noted.
void for_each_room(Study& study, const std::function<void(const Room&)>& visit);

/// A room on the backend under test, opened when something of it is measured first.
class OpenRoom {
 public:
  OpenRoom(Study& study, Room room) : study_(study), room_(std::move(room)) {}

  [[nodiscard]] const std::string& name() const { return room_.name; }
  void open();
  /// The scene; to be opened before.
  [[nodiscard]] const Scene& scene() const { return scene_; }
  /// Its default camera.
  [[nodiscard]] Camera camera() const { return select_camera(scene_, ""); }
  Image shade(int side, const ShadeOptions& options, Statistics& statistics);

 private:
  Study& study_;
  Room room_;
  Scene scene_;
  bool open_ = false;
};

}  // namespace lightcuts::app::study
