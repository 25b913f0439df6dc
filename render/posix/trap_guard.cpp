// The signal handler behind TrapGuard.
#include "render/posix/trap_guard.h"

#include <unistd.h>
#include <atomic>
#include <csignal>
#include <cstdio>

#include "stages/simd/float_traps.h"

namespace carpool::render {
namespace {

std::atomic<uint32_t> image_width{1};

const char* NameOf(int code) {
  switch (code) {
    case FPE_FLTDIV:
      return "division by zero";
    case FPE_FLTOVF:
      return "overflow";
    default:
      return "invalid operation";
  }
}

// The trap is raised by our own arithmetic, so no library is interrupted: formatting is safe here.
extern "C" void OnTrap(int, siginfo_t* info, void*) {
  const stages::TrapPlace place = stages::CurrentTrapPlace();
  const uint32_t x = place.pixel % image_width, y = place.pixel / image_width;
  char line[200];
  const int length = std::snprintf(
      line, sizeof line,
      "carpool: floating-point trap: %s in pixel %u,%u, sample %u; --pixel %u,%u --sample %u "
      "--explain shows the path\n",
      NameOf(info->si_code), x, y, place.sample, x, y, place.sample);
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, line, static_cast<size_t>(length));
  _exit(1);
}

}  // namespace

TrapGuard::TrapGuard(uint32_t width) {
  image_width = width;
  struct sigaction action = {};
  action.sa_sigaction = OnTrap;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGFPE, &action, nullptr);
}

TrapGuard::~TrapGuard() {
  std::signal(SIGFPE, SIG_DFL);
}

}  // namespace carpool::render
