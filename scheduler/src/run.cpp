// run(): puts a run together and lets threads work on it.
#include "carpool/run.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <unordered_map>

#include <tbb/task_arena.h>

#include "blocking_crew.h"
#include "run_core.h"
#include "simulated_run.h"

#if defined(__SANITIZE_THREAD__)
#define CARPOOL_TSAN 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define CARPOOL_TSAN 1
#endif
#endif
#ifdef CARPOOL_TSAN
#include <sanitizer/tsan_interface.h>
#endif

namespace carpool {
namespace {

constexpr std::uint32_t kMostWorkers = 4096;

// Arena is the caller's, the one made for this run, or the one the caller is in.
class ArenaChoice {
 public:
  explicit ArenaChoice(const RunOptions& options) {
    if (options.arena != nullptr && options.constraints) {
      throw std::invalid_argument(
          "carpool: give RunOptions either an arena or constraints for one, not both");
    }
    if (options.arena != nullptr) {
      arena_ = options.arena;
    } else if (options.constraints) {
      tbb::task_arena::constraints constraints = *options.constraints;
      if (options.threads != 0) {
        constraints.set_max_concurrency(static_cast<int>(std::min(options.threads, kMostWorkers)));
      }
      arena_ = &own_.emplace(constraints);
    } else if (options.threads != 0) {
      arena_ = &own_.emplace(static_cast<int>(std::min(options.threads, kMostWorkers)));
    } else {
      arena_ = &own_.emplace(tbb::attach{});
    }
    arena_->initialize();
    workers_ = static_cast<std::uint32_t>(std::max(1, arena_->max_concurrency()));
    workers_ = std::min(workers_, kMostWorkers);
    if (options.threads != 0) {
      workers_ = std::min(workers_, options.threads);
    }
  }

  tbb::task_arena& arena() { return *arena_; }
  std::uint32_t workers() const { return workers_; }

 private:
  std::optional<tbb::task_arena> own_;
  tbb::task_arena* arena_ = nullptr;
  std::uint32_t workers_ = 1;
};

// What an invitation needs to know. It may arrive after the run is over; then the gate is closed,
// and `core` is not touched.
struct Destination {
  std::shared_ptr<Gate> gate;
  RunCore* core;
};

// PostOffice keeps destinations alive while invitations to them are under way. They could do that
// themselves, but those that the process ends before would look like leaks, because leak checkers
// cannot see into oneTBB's memory.
class PostOffice {
 public:
  // The one office is never destroyed: oneTBB's threads may outlive what has static lifetime.
  static PostOffice& instance() {
    static PostOffice* const office = std::make_unique<PostOffice>().release();
    return *office;
  }

  void send(const std::shared_ptr<const Destination>& to) {
    const std::lock_guard guard(lock_);
    Entry& entry = under_way_[to.get()];
    entry.to = to;
    ++entry.count;
  }

  std::shared_ptr<const Destination> receive(const Destination* to) {
    const std::lock_guard guard(lock_);
    const auto at = under_way_.find(to);
    std::shared_ptr<const Destination> result = at->second.to;
    if (--at->second.count == 0) {
      under_way_.erase(at);
    }
    return result;
  }

 private:
  struct Entry {
    std::shared_ptr<const Destination> to;
    std::size_t count = 0;
  };
  std::mutex lock_;
  std::unordered_map<const Destination*, Entry> under_way_;
};

// oneTBB is not instrumented for the thread sanitizer, which therefore cannot see that functors are
// handed from thread to thread properly. These two functions tell it; elsewhere they are nothing.
#ifdef CARPOOL_TSAN
char tsan_tag;
void hand_over() {
  __tsan_release(&tsan_tag);
}
void receive() {
  __tsan_acquire(&tsan_tag);
}
#else
void hand_over() {}
void receive() {}
#endif

// Custody is the first member of a functor that oneTBB stores: its memory, too, is handed on.
struct Custody {
  Custody() { receive(); }
  Custody(const Custody&) : Custody() {}
  Custody& operator=(const Custody&) = delete;
  ~Custody() { hand_over(); }
};

void serve_isolated(RunCore& core, bool searching) {
  // Isolated: a kernel that waits for a nested parallel_for must not pick up another worker's task
  // meanwhile, which would run this scheduler inside that kernel.
  tbb::this_task_arena::isolate([&] { core.serve(searching); });
}

// Invitation is the task of a helper: work until there is nothing to do, then return, which frees
// the arena's slot.
class Invitation {
 public:
  explicit Invitation(const Destination* to) : to_(to) { hand_over(); }
  Invitation(const Invitation& other) : to_(other.to_) { hand_over(); }
  Invitation& operator=(const Invitation&) = delete;
  ~Invitation() = default;

  void operator()() const {
    receive();
    const std::shared_ptr<const Destination> to = PostOffice::instance().receive(to_);
    if (!to->gate->enter()) {
      return;
    }
    do {
      serve_isolated(*to->core, true);
    } while (to->gate->leave(false) == Gate::Left::stays);
  }

 private:
  Custody custody_;  // first: made before and destroyed after the pointer
  const Destination* to_;
};

class ThreadedRun final : private Summoner {
 public:
  ThreadedRun(const Graph& graph, const RunOptions& options, ArenaChoice& choice)
      : arena_(choice.arena()),
        core_(graph, options, choice.workers(), this),
        crew_(core_),
        destination_(std::make_shared<Destination>(Destination{core_.gate, &core_})) {}

  RunReport run() {
    bool searching = false;
    do {
      do {
        const auto shift = [this, searching] {
          receive();
          serve_isolated(core_, searching);
          hand_over();
        };
        hand_over();
        arena_.execute(shift);  // by another thread, if the arena has no place for this one
        receive();
        searching = true;
      } while (core_.gate->leave(true) == Gate::Left::stays);
      // Outside the arena: a thread asleep in there would be missing from every nested
      // parallel_for.
    } while (core_.gate->wait_for_invitation() && core_.gate->enter());
    crew_.dismiss();
    return core_.report();
  }

 private:
  void summon() override {
    PostOffice::instance().send(destination_);
    arena_.enqueue(Invitation(destination_.get()));
  }

  void summon_blocking(std::uint32_t stage) override { crew_.call(stage); }

  tbb::task_arena& arena_;
  RunCore core_;
  BlockingCrew crew_;
  std::shared_ptr<const Destination> destination_;
};

std::uint32_t workers_of(const RunOptions& options) {
  switch (options.mode) {
    case RunMode::serial:
      return 1;
    case RunMode::simulated:
      return options.threads == 0 ? 4 : std::min(options.threads, kMostWorkers);
    case RunMode::threads:
      break;
  }
  return ArenaChoice(options).workers();
}

RunReport run_serial(const Graph& graph, const RunOptions& options) {
  RunCore core(graph, options, 1, nullptr);
  core.serve(false);
  core.gate->leave(true);
  return core.report();
}

}  // namespace

RunReport run(const Graph& graph, const RunOptions& options) {
  graph.validate();
  if (options.mode == RunMode::serial) {
    return run_serial(graph, options);
  }
  if (options.mode == RunMode::simulated) {
    return SimulatedRun(graph, options, workers_of(options)).run();
  }
  ArenaChoice choice(options);
  return ThreadedRun(graph, options, choice).run();
}

std::uint32_t worker_count(const RunOptions& options) {
  return workers_of(options);
}

std::uint32_t worker_count(const Graph& graph, const RunOptions& options) {
  std::uint32_t count = workers_of(options);
  for (const auto& stage : graph.stages()) {
    const bool has_threads = stage.options.blocking && options.mode != RunMode::serial;
    count += has_threads ? stage.options.concurrency : 0;
  }
  return count;
}

std::size_t worst_case_bytes(const Graph& graph, const RunOptions& options) {
  graph.validate();
  const Layout layout(graph, options, workers_of(options));
  return layout.block_bytes() + layout.table_bytes();
}

}  // namespace carpool
