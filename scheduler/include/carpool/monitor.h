// Looking at a run from outside while it is under way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace carpool {

/// RunState is what every worker and queue of a run is doing. Each number is exact, but they are
/// not of one instant.
struct RunState {
  struct Stage {
    std::string name = {};
    std::uint64_t queued = 0;   ///< Items that have left open blocks and are not done.
    std::uint64_t items = 0;    ///< Items handled so far.
    std::uint32_t running = 0;  ///< Kernel calls under way.
  };
  struct Source {
    std::string name = {};
    std::uint32_t inside = 0;  ///< Workers that are in the source now.
    bool exhausted = false;
  };
  struct Worker {
    std::string doing = {};           ///< "away", "searching", "between batches", or a node's name.
    std::uint32_t ready_blocks = 0;   ///< Published, for anybody to take.
    std::uint32_t ready_partial = 0;  ///< How many of those left before they were full.
    std::uint32_t open_blocks = 0;    ///< Being filled.
    std::uint64_t batches = 0;        ///< Kernel calls so far.
    std::uint64_t items = 0;          ///< Items handled so far.
  };

  std::uint32_t active = 0;     ///< Workers at work or searching.
  std::uint32_t searching = 0;  ///< How many of those are without work.
  std::uint32_t invited = 0;    ///< Threads that have been called and are not here yet.
  bool caller_asleep = false;   ///< The thread that called run() sleeps until it is called.
  bool stopped = false;         ///< An exception, cancel or deadline has ended the run.
  bool over = false;            ///< The last worker has left.
  std::int64_t credits = 0;     ///< Free, less those in workers' pockets; may be below zero.
  std::vector<Source> sources = {};
  std::vector<Stage> stages = {};
  std::vector<Worker> workers = {};
  std::vector<Worker> blocking_threads = {};  ///< Of blocking stages; they have nothing ready.
  std::uint64_t spilled_blocks = 0;           ///< In the file now.

  /// print writes a line for the run, and one per stage, source, worker and thread.
  void print(std::ostream& out) const;
};

class RunCore;

/// Monitor shows the run that it was given to: what a watchdog prints when nothing moves any more.
/// Copies look at the same run.
///
///     carpool::Monitor monitor;
///     std::thread watchdog([monitor] { sleep(60); if (auto state = monitor.look())
///     state->print(std::cerr); }); carpool::run(graph, {.monitor = monitor});
///
/// Thread safety: look() may be called at any time from any thread. Cost: one store per batch,
/// and another per block where a monitor is given; a look takes some microseconds and stops nobody.
class Monitor {
 public:
  Monitor();

  /// A monitor made from nullptr shows nothing. It is the default of RunOptions.
  explicit Monitor(std::nullptr_t) {}

  /// watches tells whether this monitor can show anything.
  bool watches() const { return shown_ != nullptr; }

  /// look returns the state of the run that began last, or nothing if that is over or none began.
  std::optional<RunState> look() const;

 private:
  friend class RunCore;
  struct Shown;
  void show(const RunCore& core) const;
  void forget(const RunCore& core) const;

  std::shared_ptr<Shown> shown_;
};

}  // namespace carpool
