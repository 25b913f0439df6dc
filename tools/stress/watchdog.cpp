// The thread that looks whether a run still lives.
#include "watchdog.h"

#include <cstdlib>
#include <iostream>
#include <utility>

namespace carpool_stress {

Watchdog::Watchdog(std::chrono::duration<double> limit)
    : limit_(limit), thread_([this] { watch(); }) {}

Watchdog::~Watchdog() {
  over_ = true;
  thread_.join();
}

Watchdog::Watch::Watch(Watchdog& dog, std::string who, std::vector<carpool::Monitor> monitors)
    : dog_(dog) {
  const std::lock_guard guard(dog_.lock_);
  dog_.watching_ = true;
  dog_.began_ = Clock::now();
  dog_.who_ = std::move(who);
  dog_.monitors_ = std::move(monitors);
}

Watchdog::Watch::~Watch() {
  const std::lock_guard guard(dog_.lock_);
  dog_.watching_ = false;
}

void Watchdog::watch() {
  while (!over_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const std::lock_guard guard(lock_);
    if (watching_ && Clock::now() - began_ > limit_) {
      bark();
    }
  }
}

void Watchdog::bark() const {
  std::cerr << "carpool-stress: a run hangs: " << who_ << '\n';
  for (const carpool::Monitor& monitor : monitors_) {
    if (const auto state = monitor.look()) {
      state->print(std::cerr);
    } else {
      std::cerr << "run: over, or not begun\n";
    }
  }
  std::cerr.flush();
  std::_Exit(1);
}

}  // namespace carpool_stress
