// The transitions of the gate.
#include "gate.h"

#include <bit>

#include "spin_lock.h"

namespace carpool {

Gate::Gate(std::uint32_t seats) : seats_(seats), free_seats_((seats + 63) / 64), sizes_(seats + 1) {
  for (std::uint32_t seat = 0; seat < seats; ++seat) {
    free_seats_[seat / 64].fetch_or(std::uint64_t{1} << (seat % 64), std::memory_order_relaxed);
  }
}

Gate::Invited Gate::invite() {
  std::uint64_t seen = state_.load(std::memory_order_seq_cst);
  while (hungry({seen})) {
    const bool wake_caller = View{seen}.caller_asleep();
    const std::uint64_t next = (seen + kInvited) & ~kCallerAsleep;
    // Sequentially consistent, like every change of the state: the argument in the header needs one
    // order.
    if (state_.compare_exchange_weak(seen, next, std::memory_order_seq_cst)) {
      if (!wake_caller) {
        return Invited::helper;
      }
      signal_caller();
      return Invited::caller;
    }
  }
  return Invited::nobody;
}

bool Gate::enter() {
  std::uint64_t seen = state_.load(std::memory_order_seq_cst);
  while (!View{seen}.closed()) {
    if (state_.compare_exchange_weak(seen, seen - kInvited + kActive + kSearching,
                                     std::memory_order_seq_cst)) {
      return true;
    }
  }
  return false;
}

std::uint32_t Gate::take_seat() {
  // Seats are released before active places are, so there are never fewer free seats than places
  // without one. A scan may still miss a seat that moves behind it; hence the outer loop.
  for (;;) {
    for (std::uint32_t w = 0; w < free_seats_.size(); ++w) {
      std::uint64_t free = free_seats_[w].load(std::memory_order_relaxed);
      while (free != 0) {
        const std::uint64_t lowest = free & (~free + 1);
        // Acquire: see everything that the last holder of the seat did to its worker.
        if (free_seats_[w].compare_exchange_weak(free, free & ~lowest, std::memory_order_acquire)) {
          return w * 64 + static_cast<std::uint32_t>(std::countr_zero(lowest));
        }
      }
    }
    cpu_pause();
  }
}

void Gate::release_seat(std::uint32_t seat) {
  // Release: hand the worker's state to the next holder.
  free_seats_[seat / 64].fetch_or(std::uint64_t{1} << (seat % 64), std::memory_order_release);
}

void Gate::release_hold() {
  std::uint64_t seen = state_.load(std::memory_order_seq_cst);
  std::uint64_t next = 0;
  do {
    next = seen & ~kHeld;
    if (View{next}.active() == 0) {
      next |= kClosed;
    }
  } while (!state_.compare_exchange_weak(seen, next, std::memory_order_seq_cst));
  if (View{next}.closed()) {
    signal_caller();
  }
}

void Gate::signal_caller() {
  signal_.store(1, std::memory_order_release);  // release: hand on what came before the end
  signal_.notify_one();
}

Gate::Left Gate::leave(bool caller) {
  std::uint64_t seen = state_.load(std::memory_order_seq_cst);
  std::uint64_t next = 0;
  do {
    next = seen - kActive - kSearching;
    if (View{next}.active() == 0 && !View{next}.held()) {
      next |= kClosed;
    } else if (caller) {
      next |= kCallerAsleep;
    }
    // The release half hands all that this worker did to whoever closes, and so to the caller of
    // run().
  } while (!state_.compare_exchange_weak(seen, next, std::memory_order_seq_cst));
  if (View{next}.closed()) {
    signal_caller();
    return Left::gone;
  }
  return !stopped() && any_ready() && come_back(caller) ? Left::stays : Left::gone;
}

bool Gate::come_back(bool caller) {
  std::uint64_t seen = state_.load(std::memory_order_seq_cst);
  for (;;) {
    const View view{seen};
    const bool invited_meanwhile = caller && !view.caller_asleep();
    if (view.closed() || invited_meanwhile || view.active() + view.invited() >= seats_) {
      return false;  // over; or the signal is on its way; or others will do it
    }
    if (state_.compare_exchange_weak(seen,
                                     (seen + kActive + kSearching) & ~(caller ? kCallerAsleep : 0),
                                     std::memory_order_seq_cst)) {
      return true;
    }
  }
}

bool Gate::wait_for_invitation() {
  // Acquire: pairs with the release of the one who signals.
  signal_.wait(0, std::memory_order_acquire);
  if (view().closed()) {
    return false;
  }
  // Relaxed: only the caller resets it, and nobody signals again before the caller has slept again.
  signal_.store(0, std::memory_order_relaxed);
  return true;
}

bool Gate::any_ready() const {
  for (const ReadySize& size : sizes_) {
    if (size.value.load(std::memory_order_seq_cst) != 0) {
      return true;
    }
  }
  return false;
}

}  // namespace carpool
