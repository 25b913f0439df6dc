// The bucket queue of published blocks.
#include "ready_queue.h"

#include <algorithm>
#include <mutex>

namespace carpool {

void ReadyQueue::push(ReadyBlock* ready) {
  const std::lock_guard guard(lock_);
  Lane& head = heads_[ready->lane];
  ready->newer = nullptr;
  ready->older = head.newest;
  (head.newest != nullptr ? head.newest->newer : head.oldest) = ready;
  head.newest = ready;
  used_.set(ready->lane);
  if (ready->partial) {
    partials_.store(partials_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  // Sequentially consistent: the publisher stores this and then looks whether somebody sleeps, who,
  // before, has announced that and then looks here. One of the two must see the other. See Gate.
  size_.store(size_.load(std::memory_order_relaxed) + 1, std::memory_order_seq_cst);
}

ReadyBlock* ReadyQueue::unlink(std::uint32_t lane, bool newest) {
  Lane& head = heads_[lane];
  ReadyBlock* ready = newest ? head.newest : head.oldest;
  (ready->newer != nullptr ? ready->newer->older : head.newest) = ready->older;
  (ready->older != nullptr ? ready->older->newer : head.oldest) = ready->newer;
  if (head.newest == nullptr) {
    used_.clear(lane);
  }
  if (ready->partial) {
    partials_.store(partials_.load(std::memory_order_relaxed) - 1, std::memory_order_relaxed);
  }
  // Relaxed: only going up must be seen in time; who sees an old, larger number looks in vain and
  // tries again.
  size_.store(size_.load(std::memory_order_relaxed) - 1, std::memory_order_relaxed);
  return ready;
}

ReadyBlock* ReadyQueue::take(bool newest, std::uint32_t end) {
  if (size() == 0) {
    return nullptr;  // only the owner, who is asking, could have added one
  }
  const std::lock_guard guard(lock_);
  const std::uint32_t lane = first_lane();
  return lane >= end ? nullptr : unlink(lane, newest);  // Bitmap::kNone is above all
}

void ReadyQueue::begin_at(std::uint32_t lane) {
  const std::lock_guard guard(lock_);
  begin_ = lane;
}

std::uint32_t ReadyQueue::best_lane() {
  if (size() == 0) {
    return Bitmap::kNone;
  }
  const std::lock_guard guard(lock_);
  return first_lane();
}

ReadyBlock* ReadyQueue::steal(std::uint32_t items) {
  if (size() == 0 || !lock_.try_lock()) {
    return nullptr;
  }
  const std::lock_guard guard(lock_, std::adopt_lock);
  std::uint32_t budget = std::min(size() / 2, kPartialsPerWorker);
  ReadyBlock* list = nullptr;
  ReadyBlock** tail = &list;
  std::uint32_t taken = 0;
  do {
    const std::uint32_t lane = first_lane();
    if (lane == Bitmap::kNone) {
      break;
    }
    ReadyBlock* ready = unlink(lane, false);
    taken += ready->block.items;
    ready->newer = nullptr;
    *tail = ready;
    tail = &ready->newer;
  } while (taken < items && budget-- > 1);
  return list;
}

}  // namespace carpool
