// Forks, works, and asks the system.
#include "memory.h"

#include <cerrno>
#include <cstdio>
#include <cstdlib>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bench {
namespace {

// The peak of a child process, in KiB.
long peak_of_child(const std::function<void()>& work) {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(0);
  }
  rusage usage{};
  int status = 0;
  while (child > 0 && wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  if (child < 0 || status != 0) {
    std::fprintf(stderr, "bench-scheduler: a process that measures memory failed\n");
    std::exit(1);
  }
  return usage.ru_maxrss;
}

}  // namespace

std::size_t peak_bytes(const std::function<void()>& work) {
  const long idle = peak_of_child([] {});
  const long busy = peak_of_child(work);
  return static_cast<std::size_t>(busy > idle ? busy - idle : 0) * 1024;
}

}  // namespace bench
