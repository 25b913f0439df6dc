// Keeping, merging and handing on what waits outside the workers.
#include "exchange.h"

#include <new>

#include "run_core.h"
#include "spill.h"

namespace carpool {

Exchange::Exchange(const Layout& layout, const Policy& policy, BlockPool& pool, Spill* spill,
                   Gate& gate, Summoner* summoner)
    : layout_(layout),
      spill_(spill),
      gate_(gate),
      summoner_(summoner),
      cache_(pool, layout),
      open_(layout, policy, cache_, *this),
      lots_(layout.stages.size()) {}

bool Exchange::admit(const Block& block, FlushCause cause) {
  const StageLayout& stage = layout_.stages[block.stage];
  {
    const std::lock_guard guard(mutex_);
    Lot& lot = lots_[block.stage];
    if (!stage.blocking && lot.running < stage.cap) {
      ++lot.running;
      update(block.stage);
      return true;
    }
    keep(block, cause);
  }
  if (stage.blocking) {
    summoner_->summon_blocking(block.stage);
  }
  return false;
}

bool Exchange::pass_on(std::uint32_t stage, Block& block, FlushCause& cause) {
  const std::lock_guard guard(mutex_);
  Lot& lot = lots_[stage];
  if (lot.items.load(std::memory_order_relaxed) != 0 && !abandoned_) {
    block = take_from(stage, cause);
    return true;
  }
  --lot.running;
  update(stage);
  return false;
}

bool Exchange::take_landed(Block& block, FlushCause& cause) {
  if (gate_.landed().load(std::memory_order_relaxed) == 0) {
    return false;
  }
  const std::lock_guard guard(mutex_);
  for (const std::uint32_t stage : layout_.stages_by_rank) {
    if (lots_[stage].takeable) {
      lots_[stage].running += layout_.stages[stage].cap != 0 ? 1 : 0;
      block = take_from(stage, cause);
      return true;
    }
  }
  return false;
}

bool Exchange::take_errand() {
  if (gate_.landed().load(std::memory_order_relaxed) == 0) {
    return false;
  }
  const std::lock_guard guard(mutex_);
  const bool errand = errand_;
  errand_ = false;
  update_hold();
  return errand;
}

bool Exchange::take_waiting(std::uint32_t stage, Block& block, FlushCause& cause) {
  const std::lock_guard guard(mutex_);
  if (abandoned_ || lots_[stage].items.load(std::memory_order_relaxed) == 0) {
    return false;
  }
  ++calls_;
  block = take_from(stage, cause);
  return true;
}

void Exchange::land(const Block& block, FlushCause cause) {
  {
    const std::lock_guard guard(mutex_);
    keep(block, cause);
  }
  if (layout_.stages[block.stage].blocking) {
    summoner_->summon_blocking(block.stage);
  }
}

void Exchange::finish_call(std::uint32_t stage, bool errand) {
  const std::lock_guard guard(mutex_);
  --calls_;
  errand_ = errand_ || (errand && !abandoned_);
  update(stage);
}

void Exchange::abandon() {
  const std::lock_guard guard(mutex_);
  abandoned_ = true;
  update_hold();
}

std::uint64_t Exchange::items() const {
  std::uint64_t sum = 0;
  for (const Lot& lot : lots_) {
    sum += lot.items.load(std::memory_order_relaxed);
  }
  return sum;
}

void Exchange::keep(const Block& block, FlushCause cause) {
  const StageLayout& stage = layout_.stages[block.stage];
  add_items(lots_[block.stage], block.items);
  if (block.items == stage.block_items) {
    append(block, cause);
  } else {
    open_.absorb(block);
    cache_.release(stage.levels[block.level].pool_class, block.data);
  }
  update(block.stage);
}

// Gets the blocks that merging has filled.
void Exchange::publish(const Block& block, FlushCause cause) {
  Block full = block;
  if (spill_ == nullptr || spill_->claim(full, cause)) {
    append(full, cause);
  } else {
    add_items(lots_[block.stage], -std::int64_t{block.items});
    cache_.release(layout_.stages[block.stage].levels[block.level].pool_class, block.data);
  }
}

void Exchange::append(const Block& block, FlushCause cause) {
  auto* ready = ::new (cache_.allocate(layout_.node_class)) ReadyBlock;
  ready->block = block;
  ready->cause = cause;
  Lot& lot = lots_[block.stage];
  (lot.newest != nullptr ? lot.newest->newer : lot.oldest) = ready;
  lot.newest = ready;
}

Block Exchange::take_from(std::uint32_t stage, FlushCause& cause) {
  Lot& lot = lots_[stage];
  Block block;
  if (ReadyBlock* ready = lot.oldest; ready != nullptr) {
    block = ready->block;
    cause = ready->cause;
    lot.oldest = ready->newer;
    lot.newest = lot.oldest != nullptr ? lot.newest : nullptr;
    cache_.release(layout_.node_class, reinterpret_cast<std::byte*>(ready));
  } else {
    open_.take_fullest(stage, block);
    cause = FlushCause::idle;
  }
  add_items(lot, -std::int64_t{block.items});
  update(stage);
  return block;
}

void Exchange::add_items(Lot& lot, std::int64_t items) {
  // Relaxed: guarded by the lock; the glances of waiting() need no order.
  lot.items.store(lot.items.load(std::memory_order_relaxed) + static_cast<std::uint64_t>(items),
                  std::memory_order_relaxed);
  if (layout_.stages[static_cast<std::size_t>(&lot - lots_.data())].blocking) {
    blocked_items_ += static_cast<std::uint64_t>(items);
  }
}

void Exchange::update(std::uint32_t index) {
  Lot& lot = lots_[index];
  const StageLayout& stage = layout_.stages[index];
  const bool takeable = lot.items.load(std::memory_order_relaxed) != 0 && !stage.blocking &&
                        (stage.cap == 0 || lot.running < stage.cap);
  if (takeable != lot.takeable) {
    lot.takeable = takeable;
    takeable_ += takeable ? 1U : ~0U;
  }
  update_hold();
}

void Exchange::update_hold() {
  // Sequentially consistent, like the size of a ReadyQueue, and for the same reason. See Gate.
  gate_.landed().store(takeable_ + (errand_ ? 1 : 0), std::memory_order_seq_cst);
  const bool wanted =
      calls_ != 0 || (!abandoned_ && (takeable_ != 0 || errand_ || blocked_items_ != 0));
  if (wanted && !held_) {
    gate_.hold();
  } else if (!wanted && held_) {
    gate_.release_hold();
  }
  held_ = wanted;
}

}  // namespace carpool
