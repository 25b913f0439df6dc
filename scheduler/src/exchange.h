// Where blocks wait that cannot lie with a worker: for stages with a cap or that block, and what
// threads outside the arena have emitted.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "block.h"
#include "block_pool.h"
#include "gate.h"
#include "layout.h"
#include "open_table.h"

namespace carpool {

class Spill;
class Summoner;

// Exchange keeps, by stage, full blocks in order of arrival, and merges partial ones bin by bin, so
// that it counts as one more worker in the memory formula.
//
// A stage with a cap has that many *tokens*. A block that gets one is *admitted*: it is published
// like any other, and its token goes from its last holder to the next block that waits. So when
// blocks of such a stage wait, all of its tokens are with workers, and the wait needs no attention.
// (What a blocking thread emits has no worker to admit it, and *lands* instead.)
//
// What waits for a blocking stage, what such a thread is working on and what has landed lies with
// no worker. While there is any of it, the exchange holds the gate.
//
// Thread-safe: one mutex, taken once per block of these stages only.
class Exchange final : private BlockSink {
 public:
  // `spill` may be null.
  Exchange(const Layout& layout, const Policy& policy, BlockPool& pool, Spill* spill, Gate& gate,
           Summoner* summoner);

  // admit offers a block of a gated stage. True: it got a token, and the caller publishes it.
  // False: it stays here. Only active workers call this.
  bool admit(const Block& block, FlushCause cause);

  // pass_on hands on the token of a batch that is done. True: to this block, which the caller
  // publishes.
  bool pass_on(std::uint32_t stage, Block& block, FlushCause& cause);

  // take_landed takes a block for a worker to run; the highest rank first, full ones first.
  bool take_landed(Block& block, FlushCause& cause);

  // take_errand tells whether a blocking thread has freed what a source or a spilled block waits
  // for, and forgets it: the caller looks at those now.
  bool take_errand();

  // For the threads of blocking stages: take_waiting begins a call, land hands over what it
  // emitted, finish_call ends it.
  bool take_waiting(std::uint32_t stage, Block& block, FlushCause& cause);
  void land(const Block& block, FlushCause cause);
  void finish_call(std::uint32_t stage, bool errand);

  // waiting returns how many items of a stage are here, about.
  std::uint64_t waiting(std::uint32_t stage) const {
    return lots_[stage].items.load(std::memory_order_relaxed);
  }

  // abandon lets the run end with items still here.
  void abandon();

  // items returns how many there are. After the run only.
  std::uint64_t items() const;

 private:
  struct Lot {
    ReadyBlock* oldest = nullptr;  // of the full blocks; linked by `newer`
    ReadyBlock* newest = nullptr;
    std::atomic<std::uint64_t> items{0};  // written under the lock
    std::uint32_t running = 0;            // tokens with workers, or calls under way
    bool takeable = false;                // by any worker
  };

  void publish(const Block& block, FlushCause cause) override;
  void append(const Block& block, FlushCause cause);
  void keep(const Block& block, FlushCause cause);
  Block take_from(std::uint32_t stage, FlushCause& cause);
  void add_items(Lot& lot, std::int64_t items);
  void update(std::uint32_t stage);
  void update_hold();

  const Layout& layout_;
  Spill* const spill_;
  Gate& gate_;
  Summoner* const summoner_;
  std::mutex mutex_;
  BlockCache cache_;
  OpenTable open_;
  std::vector<Lot> lots_;
  std::uint32_t takeable_ = 0;       // lots
  std::uint32_t calls_ = 0;          // of blocking stages, under way
  std::uint64_t blocked_items_ = 0;  // waiting for them
  bool errand_ = false;
  bool held_ = false;
  bool abandoned_ = false;
};

}  // namespace carpool
