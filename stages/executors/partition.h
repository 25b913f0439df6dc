// Splits slots by a small code, in order: counters instead of branches, for the codes of
// neighbouring paths have little to do with each other and a wrong guess costs more than the rest.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

namespace carpool::stages {

/// At most `kMost` slots in `kWays` lists, in the order in which they were given.
template <size_t kWays, size_t kMost>
class Partition {
 public:
  /// `code(slot, i)` is the list, below kWays, of the i-th slot.
  template <class Code>
  Partition(std::span<const uint32_t> slots, const Code& code) {
    assert(slots.size() <= kMost);
    std::array<size_t, kWays> count = {};
    for (size_t i = 0; i < slots.size(); ++i) {
      const uint32_t slot = slots[i];
      const size_t list = code(slot, i);
      for (size_t way = 0; way < kWays; ++way) {
        lists_[way][count[way]] = slot;
        count[way] += static_cast<size_t>(list == way);
      }
    }
    count_ = count;
  }

  std::span<const uint32_t> List(size_t way) const { return {lists_[way].data(), count_[way]}; }

 private:
  // A slot is written to every list and counted in its own.
  std::array<std::array<uint32_t, kMost>, kWays> lists_;
  std::array<size_t, kWays> count_;
};

}  // namespace carpool::stages
