// Recording what every worker of a run did and when, for a trace viewer.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <memory>

namespace carpool {

class TraceLog;

/// Trace records runs for chrome://tracing and ui.perfetto.dev: a track per worker and per thread
/// of a blocking stage, with batches by stage and bin, calls of sources, steals, searches and
/// absences; and counters of what is in flight, ready, being filled and waiting. Copies share one
/// record.
///
///     const carpool::Trace trace;
///     carpool::run(graph, {.trace = trace});
///     trace.write(file);
///
/// Runs one after another are recorded one behind the other. Memory stays below `max_bytes` (but at
/// least 16 KiB a track): when a track has used up its share, its oldest events make room, and the
/// record says how many did. Cost: some 20 ns per batch; without a trace, one test per batch.
///
/// Thread safety: one run at a time, or run() throws std::invalid_argument; write() between runs.
class Trace {
 public:
  explicit Trace(std::size_t max_bytes = std::size_t{64} << 20);

  /// A trace made from nullptr records nothing. It is the default of RunOptions.
  explicit Trace(std::nullptr_t) {}

  /// write writes the record as JSON in the Trace Event Format. Times are in microseconds since the
  /// first run began, virtual ones for simulated runs. Throws std::logic_error during a run.
  void write(std::ostream& out) const;

 private:
  friend class RunCore;
  std::shared_ptr<TraceLog> log_;
};

}  // namespace carpool
