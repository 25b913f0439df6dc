// What the workers of one run share.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <memory>
#include <vector>

#include "block_pool.h"
#include "carpool/run.h"
#include "credits.h"
#include "gate.h"
#include "layout.h"
#include "ticks.h"
#include "trace_log.h"

namespace carpool {

class BlockingWorker;
class Exchange;
class Spill;
class Worker;

// Summoner brings a thread to the run after Gate::invite() has booked an invitation for a helper.
class Summoner {
 public:
  virtual void summon() = 0;

  // caller_called tells that the caller of run() has been woken instead.
  virtual void caller_called() {}

  // summon_blocking brings a thread to a blocking stage for which items wait.
  virtual void summon_blocking(std::uint32_t stage) = 0;

 protected:
  ~Summoner() = default;
};

// RunCore is the state of a run: graph and options, gate, credits, pool, sources, outcome.
class RunCore {
 public:
  RunCore(const Graph& graph, const RunOptions& options, std::uint32_t workers, Summoner* summoner);
  ~RunCore();
  RunCore(const RunCore&) = delete;
  RunCore& operator=(const RunCore&) = delete;

  // serve lets the calling thread, which must hold an active place of the gate, work until there is
  // nothing to do.
  void serve(bool searching);

  // invite asks a thread to come if a seat is free.
  void invite();

  // fail ends the run because of an exception; the first one counts.
  void fail(std::exception_ptr exception);

  // end ends the run early without one. check_end does so if cancel or deadline ask for it.
  void end(Outcome outcome);
  void check_end() {
    if (options.cancel.cancelled()) {
      end(Outcome::cancelled);
    } else if (options.deadline && clock.now() >= *options.deadline) {
      end(Outcome::deadline);
    }
  }

  // try_enter_source takes one of the places in a source. leave_source gives it back.
  bool try_enter_source(std::uint32_t source);
  void leave_source(std::uint32_t source, bool exhausted);

  // wants_a_worker tells whether a worker should look: at a source, or at what was spilled.
  bool wants_a_worker() const;

  // source_ready tells whether a source could be called now with what is in the common purse.
  bool source_ready() const;
  bool sources_open() const {
    // Relaxed: a hint. try_enter_source decides.
    return open_sources_.load(std::memory_order_relaxed) != 0 && !options.cancel.draining();
  }

  void maybe_report_progress();  // does nothing without a callback

  // state is for another thread, while the run is under way.
  RunState state() const;

  Worker& worker(std::uint32_t index) { return *workers_[index]; }
  BlockingWorker& blocking_worker(std::uint32_t index) { return *blocking_workers_[index]; }

  // trace returns the record of this run, or null.
  TraceLog* trace() const { return trace_session_.log(); }

  // allowed_from returns, by stage, whether a node has declared an edge to it; null if it has
  // declared none. Nodes are stages, then sources.
  const std::uint8_t* allowed_from(std::uint32_t node) const {
    return allowed_[node].empty() ? nullptr : allowed_[node].data();
  }

  // report adds everything up, or rethrows. Call it when every worker and thread has left.
  RunReport report();

  const Graph& graph;
  const RunOptions& options;
  const Layout layout;
  const std::shared_ptr<Gate> gate;
  Credits credits;
  BlockPool pool;
  const std::unique_ptr<Spill> spill;        // null without Overflow::spill
  const std::unique_ptr<Exchange> exchange;  // null if no stage needs one
  RunClock clock;
  const std::uint64_t linger_ticks;  // FlushOptions::linger

 private:
  struct alignas(64) SourceState {
    std::atomic<std::uint32_t> inside{0};
    std::atomic<bool> exhausted{false};
  };

  RunState::Stage stage_state(std::size_t index) const;
  template <class Visit>
  void for_each_runner(Visit visit) const;
  void stop();
  Outcome outcome() const;
  void add_notes(RunReport& report) const;

  const TraceSession trace_session_;
  Summoner* const summoner_;
  std::vector<std::vector<std::uint8_t>> allowed_;
  std::vector<SourceState> sources_;
  std::atomic<std::uint32_t> open_sources_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<std::unique_ptr<BlockingWorker>> blocking_workers_;
  std::atomic<bool> ended_{false};
  Outcome outcome_ = Outcome::completed;
  std::exception_ptr failure_;
  std::atomic<std::int64_t> next_progress_ns_;
};

}  // namespace carpool
