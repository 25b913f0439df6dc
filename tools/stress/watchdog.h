// Ends the program when a run hangs, after having shown where.
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "carpool/monitor.h"

namespace carpool_stress {

// Watchdog prints the state of every worker and queue of a run that has not ended in time, and ends
// the program with code 1: threads that hang cannot be told to go.
class Watchdog {
 public:
  explicit Watchdog(std::chrono::duration<double> limit);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // Watch lasts as long as the work that is watched.
  class Watch {
   public:
    // `who` says in one line what it is and how to replay it.
    Watch(Watchdog& dog, std::string who, std::vector<carpool::Monitor> monitors);
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

   private:
    Watchdog& dog_;
  };

 private:
  using Clock = std::chrono::steady_clock;

  void watch();
  [[noreturn]] void bark() const;

  const std::chrono::duration<double> limit_;
  std::mutex lock_;
  bool watching_ = false;
  Clock::time_point began_;
  std::string who_;
  std::vector<carpool::Monitor> monitors_;
  std::atomic<bool> over_{false};
  std::thread thread_;  // last: it uses all the others
};

}  // namespace carpool_stress
