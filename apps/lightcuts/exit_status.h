#pragma once

#include "lightcuts/error.h"

namespace lightcuts::app {

/// Exit statuses of the command; scripts rely on them.
enum ExitStatus : int {
  kDone = 0,
  kPastLimit = 1,   ///< `compare` found an error above a limit
  kWrongUsage = 2,  ///< options, or an output path that cannot be written, known before the start
  kBadInput = 3,    ///< missing, malformed, or nothing emits light
  kNoRoom = 4,      ///< not enough memory or disk
  kNoDevice = 5,
  kInternal = 70,  ///< a mistake in this program
  kInterrupted = 130,
};

ExitStatus exit_status(Code code);

}  // namespace lightcuts::app
