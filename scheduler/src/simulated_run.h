// Plays a run with N workers on one thread: virtual time, interleaving by a seed.
#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

#include "blocking_worker.h"
#include "run_core.h"
#include "worker.h"

namespace carpool {

// SimulatedRun is a discrete-event simulation around the real workers, gate and queues. Each
// virtual thread goes through the steps that a real one goes through; between two steps of one, any
// of the others may act. A batch is taken out of its queue when it begins, and its kernel runs, and
// emits, when it ends.
class SimulatedRun final : private Summoner {
 public:
  SimulatedRun(const Graph& graph, const RunOptions& options, std::uint32_t workers);

  RunReport run();

 private:
  // What a virtual thread does at its next event.
  enum class Next { nothing, arrive, find, perform, look, fetch, block };

  struct Thread {
    Next next = Next::nothing;
    bool away = true;                    // neither at work nor on the way
    BlockingWorker* blocking = nullptr;  // set for a thread of a blocking stage, which has no seat
    std::uint32_t seat = 0;
    Worker::Work work;
  };

  struct Event {
    std::uint64_t time;
    std::uint64_t order;  // decides between events of one time; from the seed
    std::uint32_t thread;
    bool operator>(const Event& other) const {
      return time != other.time ? time > other.time : order > other.order;
    }
  };

  void step(std::uint32_t thread);
  void arrive(std::uint32_t thread);
  void sit_down(std::uint32_t thread, bool searching);
  void find(std::uint32_t thread);
  void perform(std::uint32_t thread);
  void look(std::uint32_t thread);
  void leave(std::uint32_t thread);

  void fetch(std::uint32_t thread);

  void schedule(std::uint32_t thread, Next next, double seconds);
  std::uint64_t span_of(const Worker::Work& work);
  std::uint64_t span_of_batch(std::uint32_t stage, std::uint32_t items);
  double batch_cost(std::uint32_t stage, std::uint32_t items) const;
  std::uint64_t random();
  double jittered(double seconds);

  void summon() override;
  void caller_called() override;
  void summon_blocking(std::uint32_t stage) override;

  const Simulation& settings_;
  RunCore core_;
  std::vector<Thread> threads_;  // the caller first, those of blocking stages last
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::uint64_t now_ = 0;
  double memory_free_ = 0;  // when it will have delivered all that was asked for so far
  std::uint64_t random_state_;
};

}  // namespace carpool
