// The signal handlers behind InterruptGuard.
#include "render/posix/interrupt.h"

#include <unistd.h>
#include <csignal>

namespace carpool::render {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM};
constexpr int kInterrupted = 130;

std::atomic<bool> requested{false};  // a handler may touch nothing but such a flag
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void OnSignal(int) {
  if (requested.exchange(true)) _exit(kInterrupted);
}

void Install(void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;  // no read or write elsewhere need know of us
  for (const int signal : kSignals) sigaction(signal, &action, nullptr);
}

}  // namespace

InterruptGuard::InterruptGuard() {
  requested = false;
  Install(OnSignal);
}

InterruptGuard::~InterruptGuard() {
  Install(SIG_DFL);
}

const std::atomic<bool>& InterruptGuard::Requested() const {
  return requested;
}

}  // namespace carpool::render
