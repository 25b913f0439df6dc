// Running a graph: the options of a run, and run() itself.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include <tbb/task_arena.h>

#include "carpool/cancel.h"
#include "carpool/graph.h"
#include "carpool/monitor.h"
#include "carpool/policy.h"
#include "carpool/report.h"
#include "carpool/trace.h"

namespace carpool {

/// RunMode says what executes the graph. The kernels cannot tell the difference.
enum class RunMode {
  threads,    ///< The workers of a oneTBB arena, the calling thread among them.
  serial,     ///< The calling thread alone, in an order that the graph and the options decide.
  simulated,  ///< The calling thread playing N workers in virtual time, interleaved by a seed.
};

/// Simulation is what the mode `simulated` needs to know. The workers it plays are
/// RunOptions::threads (zero: 4). Kernels really run, one at a time, so results are real; time is
/// made up from these costs. The same seed gives the same run, batch for batch: that is how a
/// failure replays, and how a run is predicted for machines nobody has at hand.
struct Simulation {
  std::uint64_t seed = 1;

  /// The moment at which virtual time begins; deadlines are counted from it. Default: when the run
  /// begins, which makes no two runs with a deadline quite the same.
  std::optional<std::chrono::steady_clock::time_point> start = std::nullopt;

  /// How long a batch of so many items of a stage takes. Empty: 100 ns and 20 ns per item.
  std::function<double(std::uint32_t stage, std::uint32_t items)> batch_seconds = {};

  /// How many bytes a batch moves to and from the memory that all workers share. Empty: none.
  std::function<double(std::uint32_t stage, std::uint32_t items)> batch_bytes = {};
  double memory_bytes_per_second = 20e9;  ///< Of all together; what is asked for beyond that waits.

  double source_item_seconds = 10e-9;  ///< A source, per item.
  double choose_seconds = 50e-9;       ///< Finding the next batch among one's own.
  double publish_seconds = 50e-9;      ///< Handing on a block that is full, or was asked for.
  double steal_seconds = 500e-9;       ///< Finding the next batch with another worker.
  double wake_seconds = 20e-6;         ///< From an invitation to the helper's arrival.

  /// Every duration is multiplied by a random factor between 1 - jitter and 1 + jitter, which makes
  /// different seeds interleave differently.
  double jitter = 0.5;
};

/// Overflow says what happens when a kernel makes more live items than were declared.
enum class Overflow {
  fail,  ///< The emit throws OverflowError, which ends the run.
  grow,  ///< The run takes more memory than worst_case_bytes() and says so in its report.

  /// Full blocks that would exceed worst_case_bytes() are written to a file, and read back when
  /// there is room. The file has no name and is gone with the run. What fails to be written or read
  /// ends the run with std::system_error. A block costs a copy to or from the system's cache of the
  /// file, and a disk's time if that does not suffice.
  spill,
};

/// FlushOptions says when a block leaves before it is full.
struct FlushOptions {
  std::uint32_t count = 0;  ///< As soon as it has this many items. Zero: the stage's block_items.
  std::chrono::nanoseconds linger{0};  ///< When it is older than this. Zero: at any age.
  bool idle = true;                    ///< When another worker is without work and asks for it.
};

/// Progress is a glance at a run that is under way. The numbers are exact per worker, but not of
/// one instant.
struct Progress {
  double seconds = 0;             ///< Since the run began.
  std::uint64_t batches = 0;      ///< Kernel calls so far.
  std::uint64_t item_visits = 0;  ///< Items handled so far, counted once per stage they visited.
};

/// RunOptions are the settings of one run. All have defaults: run(graph) is a good start.
struct RunOptions {
  /// Workers. Zero: as many as the arena offers.
  std::uint32_t threads = 0;

  /// The arena that supplies the threads; it must outlive the call. Null: the caller's current one,
  /// or, if `threads` is given, one made for this run.
  tbb::task_arena* arena = nullptr;

  /// Where the threads of an arena made for this run may be: one NUMA node, one kind of core, one
  /// thread per core. oneTBB needs its library tbbbind for that, and does without otherwise. Not
  /// together with `arena`, which has its own.
  std::optional<tbb::task_arena::constraints> constraints = std::nullopt;

  /// Credits: the most live items. Sources wait when they are used up; nothing else ever waits.
  std::uint64_t in_flight = 131072;

  Policy policy = Policy::deepest_first();
  FlushOptions flush = {};
  RunMode mode = RunMode::threads;
  Simulation simulation = {};  ///< For RunMode::simulated.
  Overflow overflow = Overflow::fail;
  std::filesystem::path spill_folder = {};  ///< For Overflow::spill. Empty: the system's own.

  /// Ends the run early on request. The default token never asks.
  CancelToken cancel = CancelToken(nullptr);

  /// Ends the run when this moment has come; bounded by one batch per worker.
  std::optional<std::chrono::steady_clock::time_point> deadline = std::nullopt;

  /// Lets other threads look at the run. The default shows nothing.
  Monitor monitor = Monitor(nullptr);

  /// Records the run for a trace viewer. The default records nothing.
  Trace trace = Trace(nullptr);

  /// Called by one worker at a time, between batches, about every `progress_every`. Keep it short.
  /// Exceptions end the run.
  std::function<void(const Progress&)> progress = {};
  std::chrono::milliseconds progress_every{200};
};

/// run executes the graph until its sources are exhausted and every item has retired.
///
/// Returns after every worker has left, so that what kernels wrote is visible to the caller. The
/// first exception that a kernel, source or callback throws is rethrown here. Cancel and deadline
/// end the run without an exception; see RunReport::outcome. Thread safety: may be called from
/// several threads at once, also with one arena, and from inside a kernel. Errors:
/// std::invalid_argument for a graph or options that make no sense; OverflowError; whatever kernels
/// throw.
RunReport run(const Graph& graph, const RunOptions& options = {});

/// worker_count returns how many workers such a run would have, the threads of blocking stages
/// among them, which is the size for per-worker scratch memory: Batch::worker is below it.
std::uint32_t worker_count(const Graph& graph, const RunOptions& options = {});

/// worker_count, for graphs without blocking stages, and before there is a graph.
std::uint32_t worker_count(const RunOptions& options = {});

/// worst_case_bytes returns how much memory the blocks and tables of such a run can need. A run
/// stays below it whatever its kernels do, within the fan-out they declared. README.md derives the
/// formula.
std::size_t worst_case_bytes(const Graph& graph, const RunOptions& options = {});

}  // namespace carpool
