#include "progress_bar.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "console.h"
#include "text.h"

namespace lightcuts::app {
namespace {

constexpr double kDrawPeriod = 0.1;  // [s]
constexpr double kLeastWindow = 5;   // [s]
constexpr double kQuietStart = 0.5;  // [s] before a time left is shown

int terminal_columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

bool stderr_can_redraw() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) != 0 && term != nullptr && std::string_view(term) != "dumb";
}

double seconds_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

void TimeLeft::note(double seconds, double done) {
  points_.push_back({seconds, done});
  const double oldest = seconds - std::max(kLeastWindow, seconds / 2);
  while (points_.size() > 2 && points_[1].seconds <= oldest) points_.pop_front();
}

double TimeLeft::seconds() const {
  if (points_.size() < 2) return -1;
  const double time = points_.back().seconds - points_.front().seconds;
  const double done = points_.back().done - points_.front().done;
  if (time <= 0 || done <= 0 || points_.back().seconds < kQuietStart) return -1;
  return (1 - points_.back().done) * time / done;
}

ProgressBar::ProgressBar(bool wanted) : wanted_(wanted && stderr_can_redraw()) {}
ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::show(const char* stage, double done) {
  if (!wanted_) return;
  const Clock::time_point now = Clock::now();
  if (stage_ != stage) {
    stage_ = stage;
    stage_start_ = now;
    time_left_ = {};
  } else if (seconds_between(last_drawn_, now) < kDrawPeriod && done < 1) {
    return;
  }
  last_drawn_ = now;
  time_left_.note(seconds_between(stage_start_, now), done);
  draw(std::clamp(done, 0.0, 1.0));
}

void ProgressBar::draw(double done) {
  const double left = time_left_.seconds();
  const std::string tail =
      fmt::format(" {:3.0f} %{}", 100 * done, left < 0 ? "" : ", " + readable_seconds(left) + " left");
  const int room = terminal_columns() - 16 - static_cast<int>(tail.size());
  const int cells = std::clamp(room, 0, 40);
  const int full = static_cast<int>(done * cells);
  const bool coloured = stderr_has_colours();
  std::string line =
      fmt::format("\r{:<12} {}{}{}{}{}\033[K", stage_, coloured ? "\033[32m" : "", std::string(full, '#'),
                  coloured ? "\033[0m" : "", std::string(cells - full, '.'), tail);
  std::fwrite(line.data(), 1, line.size(), stderr);
  visible_ = true;
}

void ProgressBar::clear() {
  if (!visible_) return;
  std::fputs("\r\033[K", stderr);
  visible_ = false;
}

}  // namespace lightcuts::app
