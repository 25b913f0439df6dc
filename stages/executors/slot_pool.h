// Free slots of path state: worker-local stacks over one shared stock.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace carpool::stages {

/// Thread safe as long as each worker index is used by one thread at a time. Never runs dry while
/// at most `in_flight` slots are taken at once: what workers may hoard is allocated on top.
class SlotPool {
 public:
  SlotPool(uint32_t in_flight, uint32_t workers)
      : stock_(in_flight + workers * kHoard), local_(workers) {
    for (uint32_t i = 0; i < stock_.size(); ++i) {
      stock_[i] = static_cast<uint32_t>(stock_.size()) - 1 - i;
    }
    for (Local& local : local_) local.free.reserve(kHoard + kChunk);
    capacity_ = static_cast<uint32_t>(stock_.size());
  }

  uint32_t capacity() const { return capacity_; }

  /// Fills `slots`.
  void Take(uint32_t worker, std::span<uint32_t> slots) {
    std::vector<uint32_t>& free = local_[worker].free;
    while (!slots.empty()) {
      if (free.empty()) Refill(free);
      const size_t some = std::min(slots.size(), free.size());
      std::copy_n(free.end() - static_cast<ptrdiff_t>(some), some, slots.begin());
      free.resize(free.size() - some);
      slots = slots.subspan(some);
    }
  }

  void Give(uint32_t worker, std::span<const uint32_t> slots) {
    std::vector<uint32_t>& free = local_[worker].free;
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
  struct alignas(64) Local {
    std::vector<uint32_t> free;
  };

  void Refill(std::vector<uint32_t>& free) {
    const std::lock_guard lock(mutex_);
    for (uint32_t i = 0; i < kChunk && !stock_.empty(); ++i) {
      free.push_back(stock_.back());
      stock_.pop_back();
    }
  }
  void Return(std::vector<uint32_t>& free) {
    const std::lock_guard lock(mutex_);
    stock_.insert(stock_.end(), free.end() - kChunk, free.end());
    free.resize(free.size() - kChunk);
  }

  std::mutex mutex_;
  std::vector<uint32_t> stock_;
  std::vector<Local> local_;
  uint32_t capacity_ = 0;
};

}  // namespace carpool::stages
