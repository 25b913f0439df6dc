// What a monitor sees, and how it is kept from looking at a run that is gone.
#include "carpool/monitor.h"

#include <mutex>
#include <ostream>

#include "run_core.h"

namespace carpool {

struct Monitor::Shown {
  std::mutex lock;  // held while looking, so that a run waits with its end for a look
  const RunCore* core = nullptr;
};

Monitor::Monitor() : shown_(std::make_shared<Shown>()) {}

std::optional<RunState> Monitor::look() const {
  if (!shown_) {
    return std::nullopt;
  }
  const std::lock_guard guard(shown_->lock);
  if (shown_->core == nullptr) {
    return std::nullopt;
  }
  return shown_->core->state();
}

void Monitor::show(const RunCore& core) const {
  if (shown_) {
    const std::lock_guard guard(shown_->lock);
    shown_->core = &core;
  }
}

void Monitor::forget(const RunCore& core) const {
  if (shown_) {
    const std::lock_guard guard(shown_->lock);
    if (shown_->core == &core) {
      shown_->core = nullptr;
    }
  }
}

void RunState::print(std::ostream& out) const {
  out << "run: " << active << " active, " << searching << " of them searching, " << invited
      << " invited, " << credits << " credits free" << (caller_asleep ? ", caller asleep" : "")
      << (stopped ? ", stopped" : "") << (over ? ", over" : "") << '\n';
  for (const Stage& stage : stages) {
    out << "  stage " << stage.name << ": " << stage.queued << " items queued, " << stage.running
        << " calls running, " << stage.items << " items so far\n";
  }
  if (spilled_blocks != 0) {
    out << "  " << spilled_blocks << " blocks in the file\n";
  }
  for (const Source& source : sources) {
    out << "  source " << source.name << ": " << source.inside << " inside"
        << (source.exhausted ? ", exhausted" : "") << '\n';
  }
  for (std::size_t i = 0; i < workers.size(); ++i) {
    const Worker& worker = workers[i];
    out << "  worker " << i << ": " << worker.doing << "; " << worker.ready_blocks
        << " ready blocks (" << worker.ready_partial << " partial), " << worker.open_blocks
        << " open; " << worker.batches << " batches, " << worker.items << " items so far\n";
  }
  for (std::size_t i = 0; i < blocking_threads.size(); ++i) {
    const Worker& thread = blocking_threads[i];
    out << "  blocking thread " << i << ": " << thread.doing << "; " << thread.batches
        << " batches, " << thread.items << " items so far\n";
  }
}

}  // namespace carpool
