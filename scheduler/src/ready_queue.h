// One worker's published blocks, in the order of the policy, from which others steal.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "bitmap.h"
#include "block.h"
#include "layout.h"
#include "spin_lock.h"

namespace carpool {

// ReadyQueue is a bucket queue: lanes of linked blocks and a bitmap of the lanes in use. All
// operations take constant time.
//
// Properties and assumptions: push() and take() are the owner's, steal() is everybody's; guarded by
// a spin lock, which costs an owner about as much as the barriers of a lock-free deque would, once
// per block of some hundred items; lane 0 is taken first; `size` is readable without the lock by
// those who look for work.
class ReadyQueue {
 public:
  ReadyQueue(std::uint32_t lanes, std::atomic<std::uint32_t>& size)
      : heads_(lanes), used_(lanes), size_(size) {}

  void push(ReadyBlock* ready);

  // take returns the best block of the lanes below `end`, the newest or oldest of its lane, or
  // null.
  ReadyBlock* take(bool newest, std::uint32_t end);

  // begin_at says from which lane on, and round to it, lanes are looked through: a ring. For the
  // owner.
  void begin_at(std::uint32_t lane);

  // best_lane returns the lane that take() would look into first, or Bitmap::kNone. For the owner;
  // thieves may be quicker.
  std::uint32_t best_lane();

  // steal takes the best block, the oldest of its lane, and more of them while they are tiny: up to
  // `items` items or half of the queue. Returns a list linked by `newer`, or null if there is
  // nothing or the lock is taken.
  ReadyBlock* steal(std::uint32_t items);

  // How many partial blocks are out, as the owner sees it.
  std::uint32_t partials() const { return partials_.load(std::memory_order_relaxed); }
  std::uint32_t size() const { return size_.load(std::memory_order_relaxed); }

  // bytes_for returns how much memory a queue of that many lanes takes; it never changes.
  static std::size_t bytes_for(std::uint32_t lanes) {
    return lanes * sizeof(Lane) + Bitmap(lanes).bytes();
  }

 private:
  struct Lane {
    ReadyBlock* newest = nullptr;
    ReadyBlock* oldest = nullptr;
  };
  ReadyBlock* unlink(std::uint32_t lane, bool newest);
  std::uint32_t first_lane() const {
    return begin_ == 0 ? used_.first() : used_.first_from(begin_);
  }

  SpinLock lock_;
  std::vector<Lane> heads_;
  Bitmap used_;
  std::uint32_t begin_ = 0;
  std::atomic<std::uint32_t> partials_{0};
  std::atomic<std::uint32_t>& size_;
};

}  // namespace carpool
