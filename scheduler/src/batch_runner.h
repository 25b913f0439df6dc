// Runs batches: what a kernel call needs and what is booked after it.
#pragma once

#include <cstdint>

#include "block_pool.h"
#include "credits.h"
#include "open_table.h"
#include "run_core.h"
#include "stats.h"
#include "trace_log.h"

namespace carpool {

// BatchRunner is the part that workers of the arena and threads of blocking stages have in common:
// a share of the memory and of the credits, the open blocks into which kernels emit, and the
// counters. Used by one thread at a time.
class BatchRunner {
 public:
  // `sink` gets the blocks that become full. `index` is what kernels see as Batch::worker.
  BatchRunner(RunCore& core, std::uint32_t index, BlockSink& sink);

  // run calls the kernel for a block and gives its memory back. `virtual_ticks` is what that costs
  // in a simulation. An exception of the kernel passes through; the block is lost then.
  void run(const Block& block, FlushCause cause, std::uint64_t virtual_ticks);

  // keep sees to it that a full block which has left its worker may stay in memory; if not, it has
  // gone to the file (false).
  bool keep(Block& block, FlushCause cause);

  // call_source calls a source, which must have been entered, and leaves it.
  void call_source(std::uint32_t source, std::uint32_t budget, std::uint64_t virtual_ticks);

  BlockCache& cache() { return cache_; }
  CreditCache& credits() { return credits_; }
  const CreditCache& credits() const { return credits_; }
  OpenTable& open() { return open_; }
  WorkerStats& stats() { return stats_; }
  const WorkerStats& stats() const { return stats_; }

  // state is for other threads, at any time; without what is ready.
  RunState::Worker state() const;

  // record adds to the trace, if there is one; times are ticks of the run. trace is where, or null.
  void record(TraceEvent event);
  TraceLane* trace() const { return trace_; }

  // now returns the ticks at the end of the last timed call.
  std::uint64_t now() const { return now_; }
  void set_now(std::uint64_t ticks) { now_ = ticks; }

 private:
  void count(const Block& block, FlushCause cause, std::uint64_t ticks);

  RunCore& core_;
  const Layout& layout_;
  const std::uint32_t index_;
  const bool always_timed_;
  TraceLane* const trace_;
  BlockCache cache_;
  CreditCache credits_;
  OpenTable open_;
  WorkerStats stats_;
  std::uint32_t tiny_batches_ = 0;  // since the last timed one
  std::uint64_t now_ = 0;
};

}  // namespace carpool
