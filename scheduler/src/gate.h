// Who is at work: how workers come, look for work, leave, are called back, and how a run knows that
// it is over.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace carpool {

// Gate is the one protocol for sleep, wake-up and the end of a run. One word holds all of its
// state.
//
// A worker is *active* from enter() to leave(). It is *searching* while active without work. An
// *invitation* is an active seat that somebody has been asked to take. Items lie only with active
// workers, who do not leave before they have none; so when the last active worker leaves, no item
// is left, and since he has looked at the sources after giving back his credits, no source can
// admit one: that moment is the end of the run, and leave() closes the gate in the same step.
// No counter of items is needed.
//
// No lost wake-up: a publisher first makes its block visible (ready_size, sequentially consistent)
// and then reads the state; a leaver first changes the state and then reads every ready_size. In
// the one order that all these operations have, at least one of the two comes second and sees the
// other: either the publisher invites, or the leaver stays. A wake-up that were lost all the same
// would cost parallelism, not progress, because the publisher is active and will run the block
// itself.
//
// A *hold* keeps the gate open while items lie outside, with stages that block or with what their
// threads emitted (Exchange). It is set by an active worker, and released when no such item is left
// and nobody needs to look at the sources because of one. Those threads are no workers; their items
// need a worker to come, so for them a wake-up must not be lost. It is not: by the argument above
// the invitation goes to the caller of run() if he sleeps, who always comes, and if he does not
// sleep, he looks again before he does.
//
// The gate outlives the run in the hands of invitations that arrive too late; they find it closed.
// All that a leaver reads after it has left is therefore in the gate.
class Gate {
 public:
  explicit Gate(std::uint32_t seats);

  // What one look at the state can tell.
  struct View {
    std::uint64_t word;
    std::uint32_t active() const { return field(kActiveShift); }
    std::uint32_t searching() const { return field(kSearchingShift); }
    std::uint32_t invited() const { return field(kInvitedShift); }
    bool caller_asleep() const { return (word & kCallerAsleep) != 0; }
    bool held() const { return (word & kHeld) != 0; }
    bool closed() const { return (word & kClosed) != 0; }

   private:
    std::uint32_t field(unsigned shift) const {
      return static_cast<std::uint32_t>(word >> shift & 0xffff);
    }
  };

  // Sequentially consistent: see "No lost wake-up".
  View view() const { return {state_.load(std::memory_order_seq_cst)}; }
  View relaxed_view() const { return {state_.load(std::memory_order_relaxed)}; }

  // hungry tells whether a seat is free that nobody has been asked to take, and nobody is searching
  // already.
  bool hungry(View seen) const {
    return seen.searching() == 0 && seen.active() + seen.invited() < seats_ && !seen.closed();
  }

  enum class Invited { nobody, caller, helper };

  // invite books an invitation if the gate is hungry. For `helper` the caller of invite() must see
  // to it that a thread comes.
  Invited invite();

  // enter takes an active, searching place by an invitation. False if the run is over.
  bool enter();

  // take_seat returns a free seat; the active place is the right to one. release_seat gives it
  // back.
  std::uint32_t take_seat();
  void release_seat(std::uint32_t seat);

  void begin_search() { state_.fetch_add(kSearching, std::memory_order_seq_cst); }
  // end_search returns the state after it.
  View end_search() {
    return {state_.fetch_sub(kSearching, std::memory_order_seq_cst) - kSearching};
  }

  enum class Left { gone, stays };

  // leave gives up the active place; the worker must be searching and hold no seat. `stays` if
  // there was work after all: the worker is active and searching as before.
  Left leave(bool caller);

  // wait_for_invitation puts the calling thread to sleep until it is invited (true) or the run is
  // over (false).
  bool wait_for_invitation();

  // hold keeps the run from ending; only while active. release_hold lets it end, and ends it if
  // nobody is active.
  void hold() { state_.fetch_or(kHeld, std::memory_order_seq_cst); }
  void release_hold();

  // any_ready tells whether any worker has published blocks, or something has landed.
  bool any_ready() const;

  std::atomic<std::uint32_t>& ready_size(std::uint32_t seat) { return sizes_[seat].value; }

  // Not zero if something for workers has come from outside.
  std::atomic<std::uint32_t>& landed() { return sizes_[seats_].value; }

  // Set once the run has failed or been ended: leavers do not look back then.
  void stop() { stopped_.store(true, std::memory_order_release); }
  // Acquire: who sees the stop sees why.
  bool stopped() const { return stopped_.load(std::memory_order_acquire); }

 private:
  static constexpr unsigned kActiveShift = 0;
  static constexpr unsigned kSearchingShift = 16;
  static constexpr unsigned kInvitedShift = 32;
  static constexpr std::uint64_t kActive = 1ULL << kActiveShift;
  static constexpr std::uint64_t kSearching = 1ULL << kSearchingShift;
  static constexpr std::uint64_t kInvited = 1ULL << kInvitedShift;
  static constexpr std::uint64_t kCallerAsleep = 1ULL << 48;
  static constexpr std::uint64_t kHeld = 1ULL << 49;
  static constexpr std::uint64_t kClosed = 1ULL << 63;

  struct alignas(64) ReadySize {
    std::atomic<std::uint32_t> value{0};
  };

  bool come_back(bool caller);
  void signal_caller();

  const std::uint32_t seats_;
  alignas(64) std::atomic<std::uint64_t> state_{kActive};  // the caller is at work from the start
  alignas(64) std::atomic<bool> stopped_{false};
  std::atomic<std::uint32_t> signal_{0};  // for the caller: 1 when invited or over
  std::vector<std::atomic<std::uint64_t>> free_seats_;
  std::vector<ReadySize> sizes_;  // by seat, and `landed` at the end
};

}  // namespace carpool
