// The exceptions that the scheduler itself throws.
#pragma once

#include <stdexcept>

namespace carpool {

/// OverflowError says that a run would have left its memory bound: a kernel made more live items
/// than its source's fan_out (or its stage's weight) declares.
class OverflowError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace carpool
