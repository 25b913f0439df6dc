// What is done to a run, and what must be true of it.
#include "trial.h"

#include <algorithm>
#include <thread>
#include <utility>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "allocations.h"
#include "idle_cost.h"
#include "random_settings.h"

namespace carpool_stress {
namespace {

using carpool_test::RandomGraph;
using std::chrono::steady_clock;

constexpr double kIdleLimit = 0.05;  // of a core

// The only exception that a trial throws into a run.
struct Thrown {
  std::uint64_t seed;
};

// One line: what it was, and the command that repeats it; again and again on threads, where an
// interleaving cannot be repeated at will.
std::string with_replay(const std::string& what, const Scenario& scenario) {
  const std::string seed = std::to_string(scenario.seed);
  return what + "; seed " + seed + ": " + scenario.description() +
         "; replay: carpool-stress --seed " + seed +
         (scenario.simulated() ? " --runs 1" : " --repeat");
}

bool throws(Ending ending) {
  switch (ending) {
    case Ending::kernel_throws:
    case Ending::all_throw:
    case Ending::source_throws:
    case Ending::policy_throws:
    case Ending::progress_throws:
      return true;
    default:
      return false;
  }
}

}  // namespace

Trial::Trial(const Scenario& scenario, Sabotage sabotage)
    : scenario_(scenario),
      sabotage_(sabotage),
      options_(scenario.options),
      random_(scenario.shape),
      calls_left_(static_cast<std::int64_t>(scenario.moment)) {
  options_.monitor = monitor_;
  random_.lose_items = sabotage == Sabotage::lose_item;
  random_.on_batch = [this] {
    keep_company();
    at_call();
  };
  arm_ending();
}

// Whatever does not happen in a kernel.
void Trial::arm_ending() {
  const auto raise_in_time = [this] {
    if (calls_left_.fetch_sub(1) == 0) {
      raise();
    }
  };
  switch (scenario_.ending) {
    case Ending::source_throws:
      random_.on_source = raise_in_time;
      break;
    case Ending::policy_throws:
      options_.policy =
          carpool::Policy::custom("throws", 16, [raise_in_time](const carpool::BlockInfo& block) {
            raise_in_time();
            return block.bin % 16;
          });
      break;
    case Ending::progress_throws:
      options_.progress = [raise_in_time](const carpool::Progress&) { raise_in_time(); };
      options_.progress_every = std::chrono::milliseconds(0);
      break;
    case Ending::cancel_inside:
    case Ending::cancel_outside:
    case Ending::drain:
      options_.cancel = carpool::CancelToken();
      random_.on_source = [this] { late_batches_ += cancelled_ ? 1 : 0; };
      break;
    case Ending::deadline:
      options_.simulation.start = steady_clock::now();
      options_.deadline =
          *options_.simulation.start + std::chrono::microseconds(scenario_.moment * 37);
      break;
    default:
      break;
  }
}

// Happens in every kernel call.
void Trial::at_call() {
  late_batches_ += cancelled_ ? 1 : 0;
  if (throws(scenario_.ending) && scenario_.ending != Ending::kernel_throws &&
      scenario_.ending != Ending::all_throw) {
    return;  // others count the calls
  }
  const std::int64_t left = calls_left_.fetch_sub(1);
  if (left == 0 && sabotage_ == Sabotage::hang) {
    std::this_thread::sleep_for(std::chrono::hours(1));
  }
  if (left < 0 && scenario_.ending == Ending::all_throw) {
    raise();
  }
  if (left != 0) {
    return;
  }
  switch (scenario_.ending) {
    case Ending::kernel_throws:
      raise();
    case Ending::cancel_inside:
      cancelled_at_ = steady_clock::now();
      options_.cancel.cancel();
      cancelled_ = true;
      break;
    case Ending::drain:
      options_.cancel.drain();
      break;
    case Ending::idle:
      measure_idleness();
      break;
    default:
      break;
  }
}

void Trial::raise() {
  ++thrown_;
  throw Thrown{scenario_.seed};
}

void Trial::keep_company() {
  if (scenario_.company == Company::nested_loop) {
    tbb::parallel_for(0, 8, [](int) {});
  }
  if (scenario_.company == Company::nested_run && nested_.fetch_add(1) % 8 == 0) {
    RandomGraph inner({.seed = scenario_.seed, .items = 100});
    carpool::RunOptions options{.in_flight = 50};
    if (scenario_.simulated()) {
      options.threads = 3;
      options.mode = carpool::RunMode::simulated;
      options.simulation.seed = scenario_.seed;
    }
    carpool::run(inner.graph(), options);
    require(inner.counted() == inner.expected(), "a nested run lost items");
  }
}

// This worker has work and sleeps; the others find none. Once they have left, the whole process
// should use no time.
void Trial::measure_idleness() {
  for (auto state = monitor_.look(); state && (state->active > 1 || state->invited > 0);
       state = monitor_.look()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  findings_.idle_cpu_share = least_cpu_share(kIdleLimit);
  if (findings_.idle_cpu_share <= kIdleLimit) return;
  busy_ = busy_threads();
  if (const auto state = monitor_.look()) {
    busy_ += "; " + std::to_string(state->active) + " workers active, " +
             std::to_string(state->invited) + " invited";
  }
}

Findings Trial::run(Watchdog& watchdog) {
  {
    const Watchdog::Watch watch(watchdog, with_replay("no end", scenario_),
                                {monitor_, second_monitor_});
    if (scenario_.company == Company::second_run) {
      execute_beside_second_run();
    } else {
      execute();
    }
  }
  random_.forbid_calls();
  if (sabotage_ == Sabotage::late_call) {
    carpool::run(random_.graph(), {.mode = carpool::RunMode::serial});
  }
  check();
  return findings_;
}

void Trial::execute() {
  std::atomic<bool> over{false};
  std::thread canceller;
  if (scenario_.ending == Ending::cancel_outside) {
    canceller = std::thread([&] {
      while (!over && calls_left_ >= 0) {
        std::this_thread::sleep_for(std::chrono::microseconds(20));
      }
      cancelled_at_ = steady_clock::now();
      options_.cancel.cancel();
      cancelled_ = true;
    });
  }
  const std::size_t bytes_before = carpool_test::live_bytes();
  carpool_test::reset_peak_live_bytes();
  const steady_clock::time_point begin = steady_clock::now();
  try {
    report_ = carpool::run(random_.graph(), options_);
  } catch (...) {
    exception_ = std::current_exception();
  }
  const steady_clock::time_point end = steady_clock::now();
  measured_bytes_ = carpool_test::peak_live_bytes() - bytes_before;
  over = true;
  if (canceller.joinable()) {
    canceller.join();
  }
  findings_.seconds = std::chrono::duration<double>(end - begin).count();
  if (cancelled_ && cancelled_at_ < end) {
    findings_.cancel_seconds = std::chrono::duration<double>(end - cancelled_at_).count();
  }
}

void Trial::execute_beside_second_run() {
  tbb::task_arena arena(static_cast<int>(scenario_.options.threads));
  options_.threads = 0;
  options_.arena = &arena;
  const std::uint64_t seed = scenario_.seed + 1'000'003;
  RandomGraph other(carpool_test::random_shape(seed));
  std::exception_ptr other_failure;
  std::thread second([&] {
    try {
      carpool::RunOptions options = carpool_test::random_options(seed, 0);
      options.arena = &arena;
      options.monitor = second_monitor_;
      carpool::run(other.graph(), options);
    } catch (...) {
      other_failure = std::current_exception();
    }
  });
  execute();
  second.join();
  options_.arena = nullptr;  // it is gone
  options_.threads = scenario_.options.threads;
  require(other_failure == nullptr, "a second run got an exception that was not its own");
  require(other.counted() == other.expected(), "a second run lost items");
}

void Trial::check() {
  check_quiet();
  if (exception_) {
    check_exception();
  } else {
    check_report();
    check_memory();
  }
  require((exception_ != nullptr) == (thrown_ > 0), "an exception got lost");
  require(random_.caps_held(), "more calls of a stage at once than its cap allows");
  findings_.visits = random_.counted().visits;
  findings_.late_batches = late_batches_;
  // Each worker may have begun one call since it last looked, and looks after that.
  require(late_batches_ <= carpool::worker_count(random_.graph(), options_),
          "more than one call per worker began after a cancel");
  if (findings_.idle_cpu_share > kIdleLimit) {
    fail("workers without work used " + std::to_string(findings_.idle_cpu_share) +
         " cores: " + busy_);
  }
}

void Trial::check_exception() const {
  try {
    std::rethrow_exception(exception_);
  } catch (const Thrown& thrown) {
    require(throws(scenario_.ending) && thrown.seed == scenario_.seed,
            "an exception of another run arrived");
  } catch (const Failure&) {
    throw;
  } catch (const std::exception& unexpected) {
    fail(std::string("unexpected exception: ") + unexpected.what());
  }
}

void Trial::check_report() const {
  switch (report_->outcome) {
    case carpool::Outcome::completed:
      require(random_.counted() == random_.expected(), "items were lost or handled twice");
      break;
    case carpool::Outcome::drained:
      require(scenario_.ending == Ending::drain, "drained, though nobody asked");
      require(random_.counted() == random_.admitted(), "a drained run lost items");
      break;
    case carpool::Outcome::cancelled:
      require(options_.cancel.cancelled(), "cancelled, though nobody asked");
      return;
    case carpool::Outcome::deadline:
      require(scenario_.ending == Ending::deadline, "deadline, though there was none");
      return;
  }
  require(report_->dropped_items == 0, "a run that came to its end dropped items");
  std::uint64_t visits = 0;
  for (const carpool::StageReport& stage : report_->stages) {
    visits += stage.items;
  }
  require(visits == random_.counted().visits, "the report miscounts items");
}

void Trial::check_memory() {
  const auto formula = static_cast<double>(carpool::worst_case_bytes(random_.graph(), options_));
  findings_.memory_share = static_cast<double>(report_->peak_bytes) / formula;
  require(findings_.memory_share <= 1, "memory above the formula");
  if (!carpool_test::counts_allocations() || scenario_.company != Company::alone) {
    return;
  }
  // The formula is about blocks and tables; the rest is the report, the arena and the workers'
  // fixed parts.
  const double rest = 65536 + 4096.0 * carpool::worker_count(random_.graph(), options_) +
                      32.0 * random_.graph().slots();
  findings_.measured_share = static_cast<double>(measured_bytes_) / (formula + rest);
  require(findings_.measured_share <= 1, "measured memory above the formula");
}

void Trial::check_quiet() const {
  require(random_.late_calls() == 0, "a kernel or source was called after run() had ended");
}

void Trial::require(bool condition, const char* what) const {
  if (!condition) {
    fail(what);
  }
}

void Trial::fail(const std::string& what) const {
  throw Failure(with_replay(what, scenario_));
}

Findings TrialRunner::run(const Scenario& scenario) {
  constexpr std::size_t kKept = 8;
  past_.push_back(std::make_unique<Trial>(scenario, sabotage_));
  const Findings findings = past_.back()->run(watchdog_);
  if (past_.size() > kKept) {
    past_.front()->check_quiet();
    past_.pop_front();
  }
  return findings;
}

}  // namespace carpool_stress
