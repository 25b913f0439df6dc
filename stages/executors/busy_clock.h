// How long threads had nothing to do, in executors whose threads are oneTBB's own.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>

namespace carpool::stages {

/// Sums the time spent inside its scopes. Thread safe; scopes of one thread must not nest.
class BusyClock {
 public:
  explicit BusyClock(uint32_t threads) : threads_(threads) {}

  class Scope {
   public:
    explicit Scope(BusyClock& clock) : clock_(clock) {}
    ~Scope() {
      const auto spent = std::chrono::steady_clock::now() - begin_;
      clock_.nanoseconds_.fetch_add(
          std::chrono::duration_cast<std::chrono::nanoseconds>(spent).count(),
          std::memory_order_relaxed);
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    BusyClock& clock_;
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  };

  /// Seconds of all threads together, of `wall` seconds each, outside of any scope.
  double Idle(double wall) const {
    return std::max(0.0, threads_ * wall - 1e-9 * static_cast<double>(nanoseconds_.load()));
  }

 private:
  uint32_t threads_;
  std::atomic<int64_t> nanoseconds_{0};
};

}  // namespace carpool::stages
