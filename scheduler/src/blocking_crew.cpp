// Starting, calling and dismissing the threads of blocking stages.
#include "blocking_crew.h"

#include "blocking_worker.h"

namespace carpool {

BlockingCrew::BlockingCrew(RunCore& core) : core_(core), teams_(core.layout.stages.size()) {
  for (std::uint32_t i = 0; i < core.layout.blocking_threads; ++i) {
    teams_[core.blocking_worker(i).stage()].members.push_back(i);
  }
}

BlockingCrew::~BlockingCrew() {
  dismiss();
}

void BlockingCrew::call(std::uint32_t stage) {
  const std::lock_guard guard(mutex_);
  Team& team = teams_[stage];
  if (dismissed_ || team.calls == team.members.size()) {
    return;  // as many calls are out as there are threads, and each will look after this moment
  }
  ++team.calls;
  if (team.asleep >= team.calls) {
    team.wake.notify_one();
  } else if (team.started < team.members.size()) {
    const std::uint32_t member = team.members[team.started];
    threads_.emplace_back([this, &team, member] { serve(team, member); });
    ++team.started;
  }
}

void BlockingCrew::serve(Team& team, std::uint32_t member) {
  BlockingWorker& worker = core_.blocking_worker(member);
  std::unique_lock lock(mutex_);
  for (;;) {
    ++team.asleep;
    team.wake.wait(lock, [&] { return team.calls != 0 || dismissed_; });
    --team.asleep;
    if (dismissed_) {
      return;
    }
    --team.calls;
    lock.unlock();
    while (worker.take()) {
      worker.perform(0);
    }
    lock.lock();
  }
}

void BlockingCrew::dismiss() {
  {
    const std::lock_guard guard(mutex_);
    dismissed_ = true;
  }
  for (Team& team : teams_) {
    team.wake.notify_all();
  }
  for (std::thread& thread : threads_) {
    thread.join();
  }
  threads_.clear();
}

}  // namespace carpool
