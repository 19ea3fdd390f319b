#pragma once

#include <chrono>
#include <deque>
#include <string>

namespace lightcuts::app {

/// Time left of a stage, from how fast the last half of it (at least five seconds) went.
class TimeLeft {
 public:
  /// Notes that `done` (0 to 1) was reached after `seconds`; both never decrease.
  void note(double seconds, double done);
  /// Seconds, or a negative number while it is too early to say.
  [[nodiscard]] double seconds() const;

 private:
  struct Point {
    double seconds, done;
  };
  std::deque<Point> points_;
};

/// One line on stderr that is drawn over: stage, bar, share done, time left. Draws nothing unless stderr is a terminal
/// that can go back to a line's start, so logs stay free of it.
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Draws at most ten times a second.
  void show(const char* stage, double done);
  /// Wipes the line, so that messages can be printed.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  void draw(double done);

  bool wanted_;
  bool visible_ = false;
  std::string stage_;
  Clock::time_point stage_start_, last_drawn_;
  TimeLeft time_left_;
};

}  // namespace lightcuts::app
