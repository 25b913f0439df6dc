// Floating-point traps on this thread, for code that claims never to compute nonsense.
#pragma once

#include <cfenv>
#include <cstdint>

namespace carpool::stages {

/// While alive, invalid operations, divisions by zero and overflows raise SIGFPE on this thread.
/// Libraries are entered without: they may raise flags on purpose.
class FloatTraps {
 public:
  FloatTraps() {
#if defined(__x86_64__)
    std::feclearexcept(FE_ALL_EXCEPT);
    before_ = feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
#endif
  }
  ~FloatTraps() {
#if defined(__x86_64__)
    fedisableexcept(FE_ALL_EXCEPT);
    feenableexcept(before_);
#endif
  }
  FloatTraps(const FloatTraps&) = delete;
  FloatTraps& operator=(const FloatTraps&) = delete;

 private:
  [[maybe_unused]] int before_ = 0;
};

/// The path that this thread is at, for who handles SIGFPE.
struct TrapPlace {
  uint32_t pixel = 0, sample = 0;
};
inline TrapPlace& CurrentTrapPlace() {
  static thread_local TrapPlace place;
  return place;
}

}  // namespace carpool::stages
