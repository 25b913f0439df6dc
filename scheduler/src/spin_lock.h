// A lock for sections of some ten instructions, which two workers rarely want at once.
#pragma once

#include <atomic>
#include <thread>

#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif

namespace carpool {

inline void cpu_pause() {
#if defined(__x86_64__) || defined(__i386__)
  _mm_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

// SpinLock yields to the system after a few tries, so that a holder that lost its core gets it
// back.
class SpinLock {
 public:
  void lock() {
    for (int tries = 0; !try_lock(); ++tries) {
      if (tries < 32) {
        cpu_pause();
      } else {
        std::this_thread::yield();
      }
    }
  }
  bool try_lock() {
    // The load first keeps waiters from fighting for the line. Acquire: see what the last holder
    // wrote.
    return !held_.load(std::memory_order_relaxed) &&
           !held_.exchange(true, std::memory_order_acquire);
  }
  void unlock() {
    held_.store(false,
                std::memory_order_release);  // release: hand on what was written under the lock
  }

 private:
  std::atomic<bool> held_{false};
};

}  // namespace carpool
