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

}  // namespace carpool
