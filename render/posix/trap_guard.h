// Says which path raised a floating-point trap, instead of a bare SIGFPE.
#pragma once

#include <cstdint>

namespace carpool::render {

/// While one lives, SIGFPE ends the process with exit code 1 (are the kernels sound? no) and one
/// line on standard error that names the trap, the pixel and the sample, and the flags that show
/// the path. `width` is the image's. At most one may live at a time.
class TrapGuard {
 public:
  explicit TrapGuard(uint32_t width);
  ~TrapGuard();
  TrapGuard(const TrapGuard&) = delete;
  TrapGuard& operator=(const TrapGuard&) = delete;
};

}  // namespace carpool::render
