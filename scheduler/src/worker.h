// One worker: find a batch, run it, account for it.
#pragma once

#include <cstdint>

#include "block_pool.h"
#include "credits.h"
#include "open_table.h"
#include "ready_queue.h"
#include "run_core.h"
#include "stats.h"

namespace carpool {

// Worker is a seat in the car: all that a thread needs while it works for a run. Threads come and
// go; a worker is held by one at a time, and Gate::take_seat hands its state from one to the next.
class Worker final : private BlockSink {
 public:
  Worker(RunCore& core, std::uint32_t index);

  // serve works until there is nothing left to do, or the run was ended.
  void serve(bool searching);

  WorkerStats& stats() { return stats_; }
  const WorkerStats& stats() const { return stats_; }
  const CreditCache& credits() const { return credits_; }

  // state is for other threads, at any time.
  RunState::Worker state() const;

  // drop_all forgets every block and returns how many items were in them. After the run only.
  std::uint64_t drop_all();

  // What to do next: a batch to run, or a source to call.
  struct Work {
    Block block;
    FlushCause cause = FlushCause::full;
    bool is_source = false;
    bool stolen = false;
    std::uint32_t source = 0;
    std::uint32_t budget = 0;
    std::uint64_t virtual_ticks = 0;  // what it costs in a simulation
  };

  // The steps of serve(), for who wants to interleave workers. A shift begins and ends with the
  // worker's seat; find() takes work out of the queues, perform() does it; begin_search() and
  // sees_work() tell whether to try again, search_goes_on() whether to wait for that.
  void begin_shift(bool searching);
  bool find(Work& work);
  void perform(const Work& work);
  bool begin_search();
  bool search_goes_on() const;
  bool sees_work() const;
  void end_shift();

 private:
  bool acquire(Work& work);
  bool offers_stand() const;
  bool take_ready(Work& work, std::uint32_t end_lane);
  bool take_source(Work& work, bool last_resort);
  bool steal(Work& work);
  bool take_open(Work& work);
  void unpack(ReadyBlock* ready, Work& work);

  void run_batch(const Work& work);
  void call_source(const Work& work);
  void count_batch(const Work& work, std::uint64_t ticks);
  void after_call();
  void check_end();
  void flush_lingering();
  void share();

  bool search();
  void found_work();

  void publish(const Block& block, FlushCause cause) override;
  std::uint32_t lane_of(const Block& block) const;

  RunCore& core_;
  const Layout& layout_;
  Gate& gate_;
  const std::uint32_t index_;
  const bool newest_first_;
  const bool always_timed_;
  BlockCache cache_;
  CreditCache credits_;
  ReadyQueue ready_;
  OpenTable open_;
  WorkerStats stats_;

  bool searching_ = false;
  std::uint32_t tiny_batches_ = 0;  // since the last timed one
  std::uint32_t next_victim_ = 0;
  std::uint32_t next_source_ = 0;
  std::uint64_t now_ = 0;          // ticks at the end of the last timed call
  std::uint64_t share_after_ = 0;  // do not share before
  std::uint64_t share_pause_ = 0;  // ticks; doubles when sharing was in vain
  std::uint32_t shared_ = 0;       // blocks offered when it last shared
  std::uint32_t taken_back_ = 0;   // how many of them nobody took
  const std::uint64_t linger_ticks_;
  std::uint64_t search_began_ = 0;
  std::uint64_t came_ = 0;
};

}  // namespace carpool
