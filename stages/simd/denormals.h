// One denormal setting on every thread that runs our kernels; the caller's is restored.
#pragma once

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace carpool::stages {

/// While alive, denormals are flushed to zero on this thread, inputs and results (Embree asks for
/// it, and results must not depend on which thread ran a kernel).
class FlushDenormals {
 public:
#if defined(__x86_64__)
  FlushDenormals() : saved_(_mm_getcsr()) {
    _mm_setcsr(saved_ | 0x8040);
  }
  ~FlushDenormals() {
    _mm_setcsr(saved_);
  }
#else
  FlushDenormals() = default;
#endif
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
#if defined(__x86_64__)
  unsigned saved_;
#endif
};

}  // namespace carpool::stages
