// Turns Ctrl-C and SIGTERM into a flag that a long run can watch.
#pragma once

#include <atomic>

namespace carpool::render {

/// While one lives, the first SIGINT or SIGTERM sets Requested(); a second one ends the process at
/// once with exit code 130. At most one may live at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  const std::atomic<bool>& Requested() const;
};

}  // namespace carpool::render
