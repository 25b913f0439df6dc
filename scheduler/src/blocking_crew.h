// The real threads of blocking stages.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "run_core.h"

namespace carpool {

// BlockingCrew starts threads when items wait for a stage, up to the stage's concurrency, and lets
// them sleep while none do. Thread-safe. The destructor waits for all of them; by then the run must
// be over, or they finish the call they are in.
class BlockingCrew {
 public:
  explicit BlockingCrew(RunCore& core);
  ~BlockingCrew();
  BlockingCrew(const BlockingCrew&) = delete;
  BlockingCrew& operator=(const BlockingCrew&) = delete;

  // call brings a thread to a stage, unless all of its threads are busy; those look again before
  // they sleep. Throws std::system_error if the system has no more threads.
  void call(std::uint32_t stage);

  // dismiss waits until every thread has gone.
  void dismiss();

 private:
  struct Team {
    std::vector<std::uint32_t> members;  // of RunCore::blocking_worker
    std::size_t started = 0;
    std::uint32_t asleep = 0;
    std::uint32_t calls = 0;  // not yet answered, at most as many as members
    std::condition_variable wake;
  };

  void serve(Team& team, std::uint32_t member);

  RunCore& core_;
  std::mutex mutex_;
  std::vector<Team> teams_;  // by stage
  std::vector<std::thread> threads_;
  bool dismissed_ = false;
};

}  // namespace carpool
