// One worker: find a batch, run it, account for it.
#pragma once

#include <cstdint>
#include <utility>

#include "batch_runner.h"
#include "exchange.h"
#include "ready_queue.h"
#include "run_core.h"

namespace carpool {

// Worker is a seat in the car: all that a thread needs while it works for a run. Threads come and
// go; a worker is held by one at a time, and Gate::take_seat hands its state from one to the next.
class Worker final : private BlockSink {
 public:
  Worker(RunCore& core, std::uint32_t index);

  // serve works until there is nothing left to do, or the run was ended.
  void serve(bool searching);

  const BatchRunner& runner() const { return runner_; }

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
  std::uint32_t take_published() { return std::exchange(published_, 0); }  // blocks since last time
  bool begin_search();
  bool search_goes_on() const;
  bool sees_work() const;
  void end_shift();

 private:
  bool acquire(Work& work);
  bool offers_stand() const;
  bool take_ready(Work& work, std::uint32_t end_lane);
  bool acquire_in_order(Work& work);
  bool take_nearest(Work& work);
  void move_on_to(std::uint32_t bin);
  bool take_source(Work& work, bool last_resort);
  bool steal(Work& work);
  bool take_open(Work& work);
  bool take_from_outside(Work& work);
  bool take_landed(Work& work);
  bool take_spilled(Work& work);
  bool take_open_that_leaves_freely(Work& work);
  bool leaves_freely(Block& block, FlushCause cause);
  void unpack(ReadyBlock* ready, Work& work);

  void pass_token_on(std::uint32_t stage);
  void after_call();
  void do_chores();
  void flush_lingering();
  void feed_blocking_stages();
  void sample_queues();
  void share();

  bool search();
  void found_work();
  void end_search(std::uint64_t ticks);

  void publish(const Block& block, FlushCause cause) override;
  void push_ready(const Block& block, FlushCause cause);
  std::uint32_t lane_of(const Block& block) const;

  RunCore& core_;
  const Layout& layout_;
  Gate& gate_;
  Exchange* const exchange_;  // null if no stage needs one
  const std::uint32_t index_;
  const bool newest_first_;
  const bool in_order_;       // bins are in order ...
  const std::uint32_t half_;  // ... on a ring, of which this is half; 0: on a line
  std::uint32_t begin_ = 0;   // the bin where this worker's order begins
  const bool plain_;          // a block that leaves the open table needs no more thought
  const bool has_chores_;     // is there anything to do between batches?
  BatchRunner runner_;
  ReadyQueue ready_;

  bool searching_ = false;
  std::uint32_t next_victim_ = 0;
  std::uint32_t next_source_ = 0;
  std::uint32_t published_ = 0;    // see take_published
  std::uint64_t share_after_ = 0;  // do not share before
  std::uint64_t share_pause_ = 0;  // ticks; doubles when sharing was in vain
  std::uint32_t shared_ = 0;       // blocks offered when it last shared
  std::uint32_t taken_back_ = 0;   // how many of them nobody took
  const std::uint64_t linger_ticks_;
  std::uint64_t search_began_ = 0;
  std::uint64_t came_ = 0;
  std::uint64_t left_ = 0;         // when the seat was last left
  std::uint64_t next_sample_ = 0;  // of the counters of a trace
};

}  // namespace carpool
