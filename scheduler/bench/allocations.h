// Counts what a program takes from operator new.
#pragma once

#include <cstddef>
#include <cstdint>

namespace carpool_test {

// False under sanitizers, which bring their own operator new; then all below is zero.
bool counts_allocations();

std::uint64_t allocation_count();

// Bytes that are allocated now, and the most that were since the peak was last reset. Both count
// what the C library makes of a request.
std::size_t live_bytes();
std::size_t peak_live_bytes();
void reset_peak_live_bytes();

}  // namespace carpool_test
