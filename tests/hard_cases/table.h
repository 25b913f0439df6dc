// The table of scales and offsets: how stable the geometry is, and what robustness costs.
#pragma once

namespace carpool::test {

/// Prints leaks, self-hits and the error of a rendered room at scales 1e-6 to 1e6 and at offsets 0
/// to 1e6 m, with Embree's ROBUST flag on and off, with seconds for the same rays. Takes some
/// minutes.
void PrintTable();

}  // namespace carpool::test
