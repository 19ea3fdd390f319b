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
volatile std::sig_atomic_t in_background = 0;

/// Jobs in the background of a script are started with SIGINT ignored, so that Ctrl-C ends only what is in front. The
/// terminal's is left alone then; one that somebody sends to this very program is meant.
bool is_meant(int number, const siginfo_t& info) {
  return !(number == SIGINT && in_background != 0 && info.si_code == SI_KERNEL);
}
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

extern "C" void on_signal(int number, siginfo_t* info, void*) {
  if (!is_meant(number, *info)) return;
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
  action.sa_sigaction = on_signal;
  action.sa_flags = SA_RESTART | SA_SIGINFO;
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction old {};
    sigaction(number, nullptr, &old);
    const bool ignored = old.sa_handler == SIG_IGN;
    if (number == SIGINT) in_background = ignored ? 1 : 0;
    if (number == SIGINT || !ignored) sigaction(number, &action, nullptr);  // nohup ignores SIGHUP, and means it
  }
}

Interruption::Interruption() {
  signalled = 0;
  saving = 1;
}
Interruption::~Interruption() { saving = 0; }
bool Interruption::requested() { return signalled != 0; }

}  // namespace lightcuts::app
