// What a run says about itself when it is over.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace carpool {

/// FlushCause says why a block left the worker that filled it.
enum class FlushCause : std::uint8_t {
  full,    ///< It had block_items items.
  count,   ///< It had FlushOptions::count items.
  linger,  ///< It was older than FlushOptions::linger.
  asked,   ///< Another worker had no work and asked for it.
  idle,    ///< Its own worker had nothing better to do.
};
inline constexpr std::size_t kFlushCauses = 5;
const char* to_string(FlushCause cause);

/// Outcome says how a run ended, other than by exception.
enum class Outcome { completed, drained, cancelled, deadline };
const char* to_string(Outcome outcome);

/// BinReport is about one bin of one stage.
struct BinReport {
  std::uint64_t batches = 0;
  std::uint64_t items = 0;
};

/// StageReport is about one stage.
struct StageReport {
  std::string name = {};
  std::uint64_t batches = 0;  ///< Kernel calls.
  std::uint64_t items = 0;    ///< Items handled.
  std::vector<BinReport> bins = {};
  double run_length = 0;     ///< Items per batch: instruction coherence.
  double seats_filled = 0;   ///< SIMD lanes used / lanes offered, 0..1.
  std::uint64_t steals = 0;  ///< Blocks that ran on another worker than the one that filled them.
  std::array<std::uint64_t, kFlushCauses> flushes_by_cause = {};
  double kernel_seconds = 0;  ///< Summed over workers. Sampled where batches are tiny.
};

/// SourceReport is about one source.
struct SourceReport {
  std::string name = {};
  std::uint64_t calls = 0;
  std::uint64_t items = 0;
  double seconds = 0;
};

/// WorkerReport is about one worker: one dense index, whichever threads held it.
struct WorkerReport {
  std::uint64_t batches = 0;
  std::uint64_t items = 0;
  std::uint64_t steals = 0;
  std::uint64_t arrivals = 0;    ///< How often a thread came to this seat.
  double kernel_seconds = 0;     ///< In kernels.
  double source_seconds = 0;     ///< In sources.
  double scheduler_seconds = 0;  ///< Choosing, publishing, stealing, accounting.
  double search_seconds = 0;     ///< Present, but without work.
};

/// RunReport is everything a run measured. print() and to_json() show it.
struct RunReport {
  Outcome outcome = Outcome::completed;
  std::vector<StageReport> stages = {};
  std::vector<SourceReport> sources = {};
  std::vector<WorkerReport> workers = {};

  /// The threads of blocking stages, in order of their stages. They are not workers: their time is
  /// in blocking_seconds alone. Only batches, items and kernel_seconds are counted.
  std::vector<WorkerReport> blocking_threads = {};
  std::string policy = {};

  double seconds = 0;         ///< Wall time of the run.
  double kernel_seconds = 0;  ///< Summed over workers, as are the next three.
  double source_seconds = 0;
  double scheduler_seconds = 0;
  double idle_seconds = 0;  ///< Worker time without a batch: searching, or away for lack of work.
  double blocking_seconds = 0;  ///< In kernels of blocking stages, summed over their threads.

  std::size_t peak_bytes = 0;        ///< Memory taken for blocks and tables.
  std::size_t worst_case_bytes = 0;  ///< What the formula allowed.
  std::uint64_t peak_in_flight =
      0;  ///< Most credits lent at once, those in workers' caches counted in.
  std::uint64_t in_flight_limit = 0;
  std::uint64_t overflow_blocks = 0;   ///< Blocks beyond the bound (Overflow::grow only).
  std::uint64_t spilled_blocks = 0;    ///< Blocks written to the file (Overflow::spill only).
  std::uint64_t peak_spill_bytes = 0;  ///< The file's greatest length.
  std::uint64_t dropped_items = 0;     ///< Live items when the run was ended early.
  std::vector<std::string> notes =
      {};  ///< Advice: keys that were too many for the items, and the like.

  /// print writes tables for people.
  void print(std::ostream& out) const;

  /// to_json returns one JSON object with every number above. Bins are left out where they are more
  /// than `max_bins`.
  std::string to_json(std::size_t max_bins = 4096) const;
};

}  // namespace carpool
