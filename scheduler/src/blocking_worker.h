// One thread of a blocking stage: takes what waits for the stage, and hands over what that emits.
#pragma once

#include <cstdint>

#include "batch_runner.h"
#include "open_table.h"
#include "run_core.h"

namespace carpool {

// BlockingWorker runs batches of one blocking stage and nothing else, and keeps nothing between
// two: its open blocks land in the exchange, its credits go back to the purse. Used by one thread.
class BlockingWorker final : private BlockSink {
 public:
  BlockingWorker(RunCore& core, std::uint32_t stage, std::uint32_t index);

  // take takes a batch if one is waiting.
  bool take();

  // perform runs it. Never throws: what the kernel throws ends the run.
  void perform(std::uint64_t virtual_ticks);

  std::uint32_t stage() const { return stage_; }
  std::uint32_t items_taken() const { return block_.items; }
  const BatchRunner& runner() const { return runner_; }
  std::uint64_t dropped() const { return dropped_; }

 private:
  void publish(const Block& block, FlushCause cause) override;

  RunCore& core_;
  const std::uint32_t stage_;
  BatchRunner runner_;
  Block block_;
  FlushCause cause_ = FlushCause::full;
  std::uint64_t dropped_ = 0;  // items taken, but not run because the run had ended
};

}  // namespace carpool
