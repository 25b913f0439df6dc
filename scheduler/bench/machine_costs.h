// What this machine takes to wake a thread, to pass memory between cores, and to read it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace bench {

// lower_quartile of repeated measurements: where other programs want the cores too, the shorter
// ones are the truer ones.
double lower_quartile(std::vector<double> values);

// From an invitation to the arrival of a thread that has slept.
double measure_wake_seconds();

// Taking something from another worker moves some three cache lines between cores: lock, list and
// block.
double measure_steal_seconds();

// BigTable is far larger than any cache, and is read in pieces.
class BigTable {
 public:
  static constexpr std::uint64_t kPieces = 16384;
  static constexpr std::size_t kPieceBytes = 16384;

  BigTable();

  // sum_of returns the sum of a piece's words; any number names one.
  std::uint64_t sum_of(std::uint64_t piece) const;

 private:
  std::vector<std::uint64_t> words_;
};

// What so many threads together read of it, in bytes per second.
double measure_memory_bandwidth(const BigTable& table, int threads);

}  // namespace bench
