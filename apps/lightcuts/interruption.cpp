#include "interruption.h"

#include <unistd.h>

#include <csignal>
#include <initializer_list>

#include "exit_status.h"

namespace lightcuts::app {
namespace {

volatile std::sig_atomic_t saving = 0;     // an Interruption lives
volatile std::sig_atomic_t signalled = 0;  // it was asked to stop

extern "C" void on_signal(int) {
  if (saving == 0 || signalled != 0) _exit(kInterrupted);
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
