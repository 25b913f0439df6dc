// The event loop of a simulated run.
#include "simulated_run.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace carpool {
namespace {
constexpr std::uint32_t kCaller = 0;
constexpr double kLookSeconds = 1e-6;  // between two looks of a searching worker
}  // namespace

SimulatedRun::SimulatedRun(const Graph& graph, const RunOptions& options, std::uint32_t workers)
    : settings_(options.simulation),
      core_(graph, options, workers, this),
      threads_(workers),
      random_state_(options.simulation.seed) {
  if (!(settings_.memory_bytes_per_second > 0)) {
    throw std::invalid_argument(
        "carpool: Simulation::memory_bytes_per_second must be greater than 0");
  }
  for (std::uint32_t i = 0; i < core_.layout.blocking_threads; ++i) {
    threads_.emplace_back().blocking = &core_.blocking_worker(i);
  }
}

RunReport SimulatedRun::run() {
  sit_down(kCaller, false);
  while (!events_.empty()) {
    const Event event = events_.top();
    events_.pop();
    now_ = event.time;
    core_.clock.set_virtual_ticks(now_);
    step(event.thread);
  }
  if (!core_.gate->view().closed()) {
    throw std::logic_error("carpool: the simulated run with seed " +
                           std::to_string(settings_.seed) +
                           " has come to a standstill; this is a bug in the scheduler");
  }
  return core_.report();
}

void SimulatedRun::step(std::uint32_t thread) {
  const Next next = std::exchange(threads_[thread].next, Next::nothing);
  try {
    switch (next) {
      case Next::arrive:
        return arrive(thread);
      case Next::find:
        return find(thread);
      case Next::perform:
        return perform(thread);
      case Next::look:
        return look(thread);
      case Next::fetch:
        return fetch(thread);
      case Next::block:
        threads_[thread].blocking->perform(threads_[thread].work.virtual_ticks);
        return fetch(thread);
      case Next::nothing:
        return;
    }
  } catch (...) {
    core_.fail(std::current_exception());
    if (threads_[thread].blocking != nullptr) {
      threads_[thread].blocking->perform(0);  // drops what it has taken
    } else {
      leave(thread);
    }
  }
}

void SimulatedRun::arrive(std::uint32_t thread) {
  if (thread == kCaller &&
      !core_.gate->wait_for_invitation()) {  // does not wait: the signal is set
    return;
  }
  threads_[thread].away = true;
  if (core_.gate->enter()) {
    sit_down(thread, true);
  }
}

void SimulatedRun::sit_down(std::uint32_t thread, bool searching) {
  threads_[thread].away = false;
  threads_[thread].seat = core_.gate->take_seat();
  core_.worker(threads_[thread].seat).begin_shift(searching);
  schedule(thread, Next::find, settings_.choose_seconds);
}

void SimulatedRun::find(std::uint32_t thread) {
  Thread& self = threads_[thread];
  Worker& worker = core_.worker(self.seat);
  if (worker.find(self.work)) {
    self.work.virtual_ticks = span_of(self.work);
    const double extra = self.work.stolen ? settings_.steal_seconds : 0.0;
    self.next = Next::perform;
    events_.push({now_ + self.work.virtual_ticks + static_cast<std::uint64_t>(extra * 1e9),
                  random(), thread});
  } else if (core_.gate->stopped()) {
    leave(thread);
  } else if (worker.begin_search()) {
    schedule(thread, Next::find, settings_.choose_seconds);
  } else {
    look(thread);
  }
}

void SimulatedRun::perform(std::uint32_t thread) {
  Worker& worker = core_.worker(threads_[thread].seat);
  worker.perform(threads_[thread].work);
  const double publishing = settings_.publish_seconds * worker.take_published();
  schedule(thread, Next::find, settings_.choose_seconds + publishing);
}

void SimulatedRun::look(std::uint32_t thread) {
  const Worker& worker = core_.worker(threads_[thread].seat);
  if (!worker.search_goes_on()) {
    leave(thread);
  } else if (worker.sees_work()) {
    schedule(thread, Next::find, settings_.choose_seconds);
  } else {
    schedule(thread, Next::look, kLookSeconds);
  }
}

void SimulatedRun::leave(std::uint32_t thread) {
  Thread& self = threads_[thread];
  core_.worker(self.seat).end_shift();
  core_.gate->release_seat(self.seat);
  self.away = true;
  if (core_.gate->leave(thread == kCaller) == Gate::Left::stays) {
    sit_down(thread, true);
  }
}

// A thread of a blocking stage takes what waits, or sleeps.
void SimulatedRun::fetch(std::uint32_t thread) {
  Thread& self = threads_[thread];
  self.away = !self.blocking->take();
  if (!self.away) {
    self.work.virtual_ticks = span_of_batch(self.blocking->stage(), self.blocking->items_taken());
    self.next = Next::block;
    events_.push({now_ + self.work.virtual_ticks, random(), thread});
  }
}

void SimulatedRun::schedule(std::uint32_t thread, Next next, double seconds) {
  threads_[thread].next = next;
  const auto ticks = static_cast<std::uint64_t>(jittered(seconds) * 1e9);
  events_.push({now_ + std::max<std::uint64_t>(1, ticks), random(), thread});
}

std::uint64_t SimulatedRun::span_of(const Worker::Work& work) {
  if (work.is_source) {
    return static_cast<std::uint64_t>(jittered(settings_.source_item_seconds * work.budget) * 1e9);
  }
  return span_of_batch(work.block.stage, work.block.items);
}

// Memory serves all workers in the order in which they begin: a batch ends when its kernel has
// computed and its bytes, after those of others, have come.
std::uint64_t SimulatedRun::span_of_batch(std::uint32_t stage, std::uint32_t items) {
  const auto computed = static_cast<std::uint64_t>(jittered(batch_cost(stage, items)) * 1e9);
  if (!settings_.batch_bytes) {
    return computed;
  }
  const double seconds = settings_.batch_bytes(stage, items) / settings_.memory_bytes_per_second;
  memory_free_ = std::max(memory_free_, static_cast<double>(now_)) + seconds * 1e9;
  return std::max(computed, static_cast<std::uint64_t>(memory_free_) - now_);
}

double SimulatedRun::batch_cost(std::uint32_t stage, std::uint32_t items) const {
  return settings_.batch_seconds ? settings_.batch_seconds(stage, items) : 100e-9 + 20e-9 * items;
}

std::uint64_t SimulatedRun::random() {
  random_state_ += 0x9e3779b97f4a7c15ULL;  // splitmix64
  std::uint64_t x = random_state_;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

double SimulatedRun::jittered(double seconds) {
  const double unit = static_cast<double>(random() >> 11) * 0x1p-53;  // 0..1
  return seconds * (1.0 + settings_.jitter * (2.0 * unit - 1.0));
}

void SimulatedRun::summon() {
  // The gate counts: when it books an invitation there is a thread that is neither here nor called.
  const std::uint32_t count = core_.layout.workers;
  const auto first = static_cast<std::uint32_t>(random() % count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t thread = (first + i) % count;
    if (thread != kCaller && threads_[thread].away) {
      threads_[thread].away = false;
      schedule(thread, Next::arrive, settings_.wake_seconds);
      return;
    }
  }
  throw std::logic_error("carpool: the gate invited more helpers than there are");
}

void SimulatedRun::summon_blocking(std::uint32_t stage) {
  for (std::uint32_t thread = core_.layout.workers; thread < threads_.size(); ++thread) {
    if (threads_[thread].away && threads_[thread].blocking->stage() == stage) {
      threads_[thread].away = false;
      schedule(thread, Next::fetch, settings_.wake_seconds);
      return;
    }
  }
}

void SimulatedRun::caller_called() {
  schedule(kCaller, Next::arrive, settings_.wake_seconds);
}

}  // namespace carpool
