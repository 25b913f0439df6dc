// What a kernel is called with: a contiguous run of items of one stage and one bin.
#pragma once

#include <cstdint>
#include <span>

#include "carpool/item.h"

namespace carpool {

/// Batch is the run of items that one kernel call handles.
///
/// `items` lies contiguously, begins on a 64-byte boundary, is never empty, and holds at most the
/// stage's `block_items`. It is valid until the kernel returns. The order of items within a bin is
/// unspecified.
template <class T>
struct Batch {
  std::span<const T> items;  ///< The items; all of bin `bin`.
  std::uint32_t bin = 0;     ///< Which bin of the stage they were emitted to.
  std::uint32_t worker =
      0;  ///< Who runs the kernel: dense, below worker_count(), held by one call at a time.
};

}  // namespace carpool
