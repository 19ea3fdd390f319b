#pragma once

#include <string>
#include <vector>

#include "bench_study/study.h"

namespace lightcuts::app::study {

/// A scene of the pictures, or why it is not there.
struct Room {
  std::string name;
  std::string spec;  ///< as the command line names it
};

/// The study's room, and those of the issue that the scenes' folder has; a missing folder is noted.
std::vector<Room> rooms_of(Study& study);

/// Opens a room.
Scene open_room(const Room& room);

}  // namespace lightcuts::app::study
