#pragma once

namespace lightcuts::app {

/// While one of these lives, the first SIGINT, SIGTERM or SIGHUP is only noted, so that what is done can be saved; a second one
/// ends the program at once, as a first one does at any other time. At most one at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// True once a signal has come.
  [[nodiscard]] static bool requested();
};

/// Ends the program with the status of an interruption when SIGINT, SIGTERM or SIGHUP comes; call once at the start.
void end_on_signals();

}  // namespace lightcuts::app
