#include "exit_status.h"

namespace lightcuts::app {

ExitStatus exit_status(Code code) {
  switch (code) {
    case Code::invalid_argument:
    case Code::cannot_write:
      return kWrongUsage;
    case Code::file_missing:
    case Code::malformed:
    case Code::unsupported:
    case Code::invalid_scene:
    case Code::no_emitter:
      return kBadInput;
    case Code::out_of_memory:
    case Code::disk_full:
      return kNoRoom;
    case Code::no_device:
    case Code::not_built:
      return kNoDevice;
  }
  return kInternal;
}

}  // namespace lightcuts::app
