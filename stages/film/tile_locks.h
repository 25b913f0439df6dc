// Locks for the film's pixels: one for all pixels of a tile, so that neighbours need only one.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace carpool::stages {

/// Which pixels share a lock depends on their numbers alone. Thread safe.
class TileLocks {
 public:
  explicit TileLocks(uint32_t width)
      : width_(width), rows_per_pixel_((uint64_t{1} << 32) / width + 1), locks_(kLocks) {}

  /// The lock of a pixel (y * width + x): mostly that of its tile of 16x16. Numbers below 2^28.
  uint32_t Of(uint32_t pixel) const {
    const auto y = static_cast<uint32_t>(pixel * rows_per_pixel_ >> 32);  // may be one too large
    const uint32_t x = pixel - y * width_;
    return ((y / 16) * 37 + x / 16) % kLocks;
  }

  /// Locks are held for a few samples: waits awake, but yields should a holder have lost its core.
  void Lock(uint32_t which) {
    std::atomic<bool>& held = locks_[which].held;
    for (int tries = 0; held.exchange(true, std::memory_order_acquire);) {
      while (held.load(std::memory_order_relaxed)) {
        if (++tries > 100) std::this_thread::yield();
      }
    }
  }
  void Unlock(uint32_t which) { locks_[which].held.store(false, std::memory_order_release); }

 private:
  static constexpr uint32_t kLocks = 1024;
  struct alignas(64) Cell {
    std::atomic<bool> held{false};
  };

  uint32_t width_;
  uint64_t rows_per_pixel_;  // 2^32 / width, rounded up
  std::vector<Cell> locks_;
};

}  // namespace carpool::stages
