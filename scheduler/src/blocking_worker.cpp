// The batches of a blocking stage.
#include "blocking_worker.h"

#include <exception>

#include "exchange.h"

namespace carpool {

BlockingWorker::BlockingWorker(RunCore& core, std::uint32_t stage, std::uint32_t index)
    : core_(core), stage_(stage), runner_(core, index, *this) {}

bool BlockingWorker::take() {
  return core_.exchange->take_waiting(stage_, block_, cause_);
}

void BlockingWorker::perform(std::uint64_t virtual_ticks) {
  try {
    core_.check_end();
    if (core_.gate->stopped()) {
      dropped_ += block_.items;
    } else {
      runner_.run(block_, cause_, virtual_ticks);
      Block block;
      while (runner_.open().take_best(block)) {
        publish(block, FlushCause::idle);
      }
      core_.maybe_report_progress();
    }
  } catch (...) {
    core_.fail(std::current_exception());
    dropped_ += runner_.open().drop_all();
  }
  runner_.credits().return_all();  // before looking at the sources: see Gate
  runner_.stats().doing.set(kAway);
  core_.exchange->finish_call(stage_, core_.wants_a_worker());
  // Nobody is woken for nothing: what there is to do has landed, or is the errand.
  if (core_.gate->any_ready() && core_.gate->hungry(core_.gate->view())) {
    core_.invite();
  }
}

void BlockingWorker::publish(const Block& block, FlushCause cause) {
  runner_.credits().charge(runner_.open().take_spent());  // before: see Worker::publish
  runner_.stats().stages[block.stage].published.add(block.items);
  Block kept = block;
  if (!runner_.keep(kept, cause)) {
    return;  // finish_call() sends a worker for it
  }
  core_.exchange->land(kept, cause);
  if (core_.gate->hungry(core_.gate->view())) {
    core_.invite();
  }
}

}  // namespace carpool
