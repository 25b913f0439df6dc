// Free slots of path state: worker-local stacks over one stock per worker.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace carpool::stages {

/// Each worker has a range of neighbouring slots for its own and takes others' only when that is
/// empty; what it has too many of goes home. Two cores that write paths side by side, in one huge
/// page, were measured to slow each other down although no path was shared.
///
/// Thread safe as long as each worker index is used by one thread at a time. Never runs dry while
/// at most `in_flight` slots are taken at once: what workers may hoard is allocated on top.
class SlotPool {
 public:
  SlotPool(uint32_t in_flight, uint32_t workers)
      : capacity_(in_flight + workers * kHoard),
        range_((capacity_ + workers - 1) / workers),
        workers_(workers) {
    for (uint32_t slot = capacity_; slot-- > 0;) workers_[slot / range_].stock.push_back(slot);
    for (Worker& worker : workers_) worker.free.reserve(kHoard);
  }

  uint32_t capacity() const { return capacity_; }

  /// Fills `slots`.
  void Take(uint32_t worker, std::span<uint32_t> slots) {
    std::vector<uint32_t>& free = workers_[worker].free;
    while (!slots.empty()) {
      if (free.empty()) Refill(worker);
      const size_t some = std::min(slots.size(), free.size());
      std::copy_n(free.end() - static_cast<ptrdiff_t>(some), some, slots.begin());
      free.resize(free.size() - some);
      slots = slots.subspan(some);
    }
  }

  void Give(uint32_t worker, std::span<const uint32_t> slots) {
    std::vector<uint32_t>& free = workers_[worker].free;
    while (!slots.empty()) {
      if (free.size() == kHoard) Return(free);
      const size_t some = std::min(slots.size(), kHoard - free.size());
      free.insert(free.end(), slots.begin(), slots.begin() + static_cast<ptrdiff_t>(some));
      slots = slots.subspan(some);
    }
  }

 private:
  static constexpr uint32_t kChunk = 512;
  static constexpr uint32_t kHoard = 2 * kChunk;
  struct alignas(128) Worker {
    std::vector<uint32_t> free;  // the worker's own
    std::mutex mutex;
    std::vector<uint32_t> stock;  // of its range, for all
  };

  /// One chunk from the first stock that has any; none if others were quicker at each.
  void Refill(uint32_t worker) {
    std::vector<uint32_t>& free = workers_[worker].free;
    for (size_t i = 0; free.empty() && i < workers_.size(); ++i) {
      Worker& from = workers_[(worker + i) % workers_.size()];
      const std::lock_guard lock(from.mutex);
      const size_t some = std::min<size_t>(kChunk, from.stock.size());
      free.assign(from.stock.rbegin(), from.stock.rbegin() + static_cast<ptrdiff_t>(some));
      from.stock.resize(from.stock.size() - some);
    }
  }
  /// The chunk on top, each slot to the stock of its range.
  void Return(std::vector<uint32_t>& free) {
    const auto home = [&](uint32_t slot) { return slot / range_; };
    for (auto slot = free.end() - kChunk; slot != free.end();) {
      Worker& to = workers_[home(*slot)];
      const auto end = std::find_if(slot, free.end(),
                                    [&](uint32_t other) { return home(other) != home(*slot); });
      const std::lock_guard lock(to.mutex);
      to.stock.insert(to.stock.end(), slot, end);
      slot = end;
    }
    free.resize(free.size() - kChunk);
  }

  uint32_t capacity_, range_;
  std::vector<Worker> workers_;
};

}  // namespace carpool::stages
