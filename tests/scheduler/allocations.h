// Counts the allocations of the test program.
#pragma once

#include <cstdint>

namespace carpool_test {

// False under sanitizers, which bring their own operator new.
bool counts_allocations();

std::uint64_t allocation_count();

}  // namespace carpool_test
