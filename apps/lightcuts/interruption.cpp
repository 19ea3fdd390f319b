#include "interruption.h"

#include <unistd.h>

#include <csignal>
#include <ctime>
#include <initializer_list>

#include "exit_status.h"

namespace lightcuts::app {
namespace {

volatile std::sig_atomic_t saving = 0;     // an Interruption lives
volatile std::sig_atomic_t signalled = 0;  // it was asked to stop
timespec first_signal{};

/// `timeout` and some terminals send one wish to stop twice, at once; nobody types that fast.
bool is_echo() {
  constexpr double kEcho = 0.25;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const double apart = static_cast<double>(now.tv_sec - first_signal.tv_sec) +
                       1e-9 * static_cast<double>(now.tv_nsec - first_signal.tv_nsec);
  return apart < kEcho;
}

extern "C" void on_signal(int) {
  if (saving == 0) _exit(kInterrupted);
  if (signalled != 0) {
    if (is_echo()) return;
    _exit(kInterrupted);
  }
  clock_gettime(CLOCK_MONOTONIC, &first_signal);
  signalled = 1;
}

}  // namespace

void end_on_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGINT, SIGTERM}) {
    // A parent that ignores SIGINT (nohup, a job in the background) means it.
    struct sigaction old {};
    sigaction(number, nullptr, &old);
    if (old.sa_handler != SIG_IGN) sigaction(number, &action, nullptr);
  }
}

Interruption::Interruption() {
  signalled = 0;
  saving = 1;
}
Interruption::~Interruption() { saving = 0; }
bool Interruption::requested() { return signalled != 0; }

}  // namespace lightcuts::app
