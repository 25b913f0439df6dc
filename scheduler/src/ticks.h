// The cheapest clock there is, for measuring batches.
#pragma once

#include <chrono>
#include <cstdint>

#if defined(__x86_64__) || defined(__i386__)
#include <x86intrin.h>
#endif

namespace carpool {

// read_ticks returns a counter that grows at a constant rate, the same on every core.
inline std::uint64_t read_ticks() {
#if defined(__x86_64__) || defined(__i386__)
  return __rdtsc();  // not serialising: an error of some dozen cycles per batch is fine
#elif defined(__aarch64__)
  std::uint64_t value;
  asm volatile("mrs %0, cntvct_el0" : "=r"(value));
  return value;
#else
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

// TickClock measures how long a tick is, by comparing the counter with the steady clock at two
// moments.
class TickClock {
 public:
  TickClock() : start_(std::chrono::steady_clock::now()), start_ticks_(read_ticks()) {}

  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  // seconds_per_tick gets better the longer the clock has lived.
  double seconds_per_tick() const {
    const std::uint64_t ticks = read_ticks() - start_ticks_;
    return ticks == 0 ? 0.0 : seconds() / static_cast<double>(ticks);
  }

 private:
  std::chrono::steady_clock::time_point start_;
  std::uint64_t start_ticks_;
};

// RunClock is the time of a run: of the machine, or virtual, in nanoseconds, when somebody sets it.
class RunClock {
 public:
  RunClock() = default;
  // A virtual clock, which stands until it is set.
  explicit RunClock(std::chrono::steady_clock::time_point start)
      : virtual_(true), virtual_start_(start) {}

  std::uint64_t ticks() const { return virtual_ ? virtual_ticks_ : read_ticks(); }
  double seconds() const {
    return virtual_ ? 1e-9 * static_cast<double>(virtual_ticks_) : real_.seconds();
  }
  double seconds_per_tick() const { return virtual_ ? 1e-9 : real_.seconds_per_tick(); }
  std::chrono::steady_clock::time_point now() const {
    return virtual_ ? virtual_start_ + std::chrono::nanoseconds(virtual_ticks_)
                    : std::chrono::steady_clock::now();
  }
  bool is_virtual() const { return virtual_; }
  void set_virtual_ticks(std::uint64_t ticks) { virtual_ticks_ = ticks; }

 private:
  TickClock real_;
  const bool virtual_ = false;
  const std::chrono::steady_clock::time_point virtual_start_{};
  std::uint64_t virtual_ticks_ = 0;
};

}  // namespace carpool
