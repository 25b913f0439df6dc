// Runs one scenario and holds it to the scheduler's promises.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "scenario.h"
#include "watchdog.h"

namespace carpool_stress {

// Failure says in one line which promise was broken, with which seed, and how to repeat that.
class Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a trial measured. Zero where it does not apply.
struct Findings {
  std::uint64_t visits = 0;        // items handled, over all stages
  double seconds = 0;              // of the run, on the machine's clock
  double memory_share = 0;         // reported memory / what the formula allows
  double measured_share = 0;       // the same, by what the program took from operator new
  std::uint32_t late_batches = 0;  // calls begun after cancel() had returned
  double cancel_seconds = 0;       // from the cancel to the return of run()
  double idle_cpu_share = 0;       // of one core, while all workers but a sleeping one had no work
};

// Mistakes that a trial can be told to make, to show that it would find them.
enum class Sabotage { none, lose_item, late_call, hang };

// Trial is one scenario: its graph, what is done to the run, and what must be true afterwards.
class Trial {
 public:
  Trial(const Scenario& scenario, Sabotage sabotage);
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;

  // run throws Failure. Once only.
  Findings run(Watchdog& watchdog);

  // check_quiet throws Failure if a kernel or source was called after the run had ended.
  void check_quiet() const;

 private:
  void arm_ending();
  void at_call();
  void keep_company();
  [[noreturn]] void raise();
  void measure_idleness();

  void execute();
  void execute_beside_second_run();
  void check();
  void check_exception() const;
  void check_report() const;
  void check_memory();
  void require(bool condition, const char* what) const;
  [[noreturn]] void fail(const std::string& what) const;

  const Scenario scenario_;
  const Sabotage sabotage_;
  carpool::RunOptions options_;
  carpool_test::RandomGraph random_;
  carpool::Monitor monitor_;
  carpool::Monitor second_monitor_;

  std::atomic<std::int64_t> calls_left_;  // until the ending happens
  std::atomic<std::uint64_t> thrown_{0};
  std::atomic<bool> cancelled_{false};
  std::atomic<std::uint32_t> late_batches_{0};
  std::atomic<std::uint32_t> nested_{0};
  std::chrono::steady_clock::time_point cancelled_at_;

  std::optional<carpool::RunReport> report_;
  std::exception_ptr exception_;
  std::size_t measured_bytes_ = 0;
  Findings findings_;
  std::string busy_;  // who was at work when nobody should have been
};

// TrialRunner runs trials and keeps the last ones for a while: a call that comes much too late is
// noticed, and does no harm.
class TrialRunner {
 public:
  TrialRunner(Watchdog& watchdog, Sabotage sabotage) : watchdog_(watchdog), sabotage_(sabotage) {}
  ~TrialRunner() = default;
  TrialRunner(const TrialRunner&) = delete;
  TrialRunner& operator=(const TrialRunner&) = delete;

  Findings run(const Scenario& scenario);

 private:
  Watchdog& watchdog_;
  const Sabotage sabotage_;
  std::deque<std::unique_ptr<Trial>> past_;
};

}  // namespace carpool_stress
