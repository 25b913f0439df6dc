// Runs a per-target function of a test's kernel file on each SIMD target that this machine has.
//
// Include it after hwy/highway.h, in the HWY_ONCE part. FOR_EACH_TARGET(Function, visit) calls
// visit(Function()) with dispatch held to one target after the other; Function is HWY_EXPORTed.
#pragma once

#include "hwy/highway.h"

#define FOR_EACH_TARGET(function, visit)                             \
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) { \
    hwy::SetSupportedTargetsForTest(target);                         \
    visit(HWY_DYNAMIC_DISPATCH(function)());                         \
    hwy::SetSupportedTargetsForTest(0);                              \
  }
