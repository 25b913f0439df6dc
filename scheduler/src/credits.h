// In-flight credits: what a source needs to admit items, and what items give back when they retire.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace carpool {

// Credits is the common purse. It may go below zero for a while, when items grow into more items
// than there are credits left; sources wait then.
//
// Memory order: everything is relaxed. The count carries no data. That two workers who both give
// back and then look cannot both miss the sum needs only that read-modify-writes of one atomic have
// one order.
class alignas(64) Credits {
 public:
  explicit Credits(std::uint64_t limit)
      : limit_(static_cast<std::int64_t>(limit)), purse_(static_cast<std::int64_t>(limit)) {}

  std::int64_t limit() const { return limit_; }
  std::int64_t available() const { return purse_.load(std::memory_order_relaxed); }
  void give(std::int64_t credits) { purse_.fetch_add(credits, std::memory_order_relaxed); }

  // take takes without asking, and returns what is left.
  std::int64_t take(std::int64_t credits) {
    return purse_.fetch_sub(credits, std::memory_order_relaxed) - credits;
  }

  // try_take takes between `least` and `most`, or nothing and returns 0.
  std::int64_t try_take(std::int64_t least, std::int64_t most) {
    std::int64_t seen = available();
    while (seen >= least && seen > 0) {
      const std::int64_t credits = std::min(seen, most);
      if (purse_.compare_exchange_weak(seen, seen - credits, std::memory_order_relaxed)) {
        return credits;
      }
    }
    return 0;
  }

 private:
  const std::int64_t limit_;
  std::atomic<std::int64_t> purse_;
};

// CreditCache is one worker's pocket, which keeps the purse out of the inner loop.
class CreditCache {
 public:
  CreditCache(Credits& purse, std::uint32_t workers)
      : purse_(purse),
        most_(std::min<std::int64_t>(4096, purse.limit() / (2 * std::int64_t{workers}))) {}

  // charge books `spent` credits, on what a call has emitted so far. It gives nothing back: what is
  // left in the pocket may be reserved for what the call has yet to emit.
  void charge(std::int64_t spent) {
    pocket_ -= spent;
    if (pocket_ < 0) {
      note_lent(purse_.take(-pocket_));
      pocket_ = 0;
    }
  }

  // settle books the end of a call that spent `spent` credits on what it emitted and got `freed`
  // from what it consumed.
  void settle(std::int64_t spent, std::int64_t freed) {
    pocket_ += freed - spent;
    if (pocket_ > most_) {
      purse_.give(pocket_ - most_ / 2);
      pocket_ = most_ / 2;
    } else {
      charge(0);
    }
  }

  // reserve fills the pocket to between `least` and `most`, and returns what is in it, or 0. While
  // the purse is in debt, what is in the pocket is not free either: others have grown into it.
  std::int64_t reserve(std::int64_t least, std::int64_t most) {
    std::int64_t got = 0;
    if (pocket_ < most) {
      got = purse_.try_take(std::max<std::int64_t>(1, least - pocket_), most - pocket_);
      if (got > 0) {
        pocket_ += got;
        note_lent(purse_.available());
      }
    }
    return pocket_ >= least && (got > 0 || purse_.available() >= 0) ? pocket_ : 0;
  }

  void return_all() {
    if (pocket_ != 0) {
      purse_.give(pocket_);
      pocket_ = 0;
    }
  }

  std::int64_t pocket() const { return pocket_; }
  std::uint64_t peak_lent() const { return static_cast<std::uint64_t>(peak_); }

 private:
  void note_lent(std::int64_t left) { peak_ = std::max(peak_, purse_.limit() - left); }

  Credits& purse_;
  const std::int64_t most_;
  std::int64_t pocket_ = 0;
  std::int64_t peak_ = 0;
};

}  // namespace carpool
