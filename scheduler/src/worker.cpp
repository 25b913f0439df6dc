// The worker's loop.
#include "worker.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "spill.h"
#include "spin_lock.h"
#include "ticks.h"

namespace carpool {
namespace {

// A thief takes as many tiny blocks as make this many items.
constexpr std::uint32_t kWorthStealing = 32;

// How long a worker without work looks around before it leaves, and how long an owner waits after
// sharing in vain: about the cost of an invitation. In ticks; at 1 to 4 GHz some 5 to 20
// microseconds.
constexpr std::uint64_t kSearchTicks = 20'000;
constexpr std::uint64_t kFirstSharePause = 40'000;
constexpr std::uint64_t kLongestSharePause = 4'000'000;

// How often each worker samples the counters of a trace.
constexpr std::uint64_t kSampleTicks = 400'000;
constexpr std::uint64_t kSampleNanoseconds = 200'000;

}  // namespace

Worker::Worker(RunCore& core, std::uint32_t index)
    : core_(core),
      layout_(core.layout),
      gate_(*core.gate),
      exchange_(core.exchange.get()),
      index_(index),
      newest_first_(core.options.policy.kind() == Policy::Kind::deepest_first),
      in_order_(core.options.policy.kind() == Policy::Kind::bins_in_order),
      half_(core.options.policy.ring() ? core.layout.lanes / 2 : 0),
      plain_(exchange_ == nullptr && !core.spill && !core.options.monitor.watches()),
      has_chores_(core.options.progress || core.linger_ticks != 0 ||
                  core.layout.blocking_threads != 0 || core.trace() != nullptr),
      runner_(core, index, *this),
      ready_(core.layout.ready_lanes(), core.gate->ready_size(index)),
      next_victim_(index + 1),
      next_source_(index),
      share_pause_(kFirstSharePause),
      linger_ticks_(core.linger_ticks) {}

void Worker::serve(bool searching) {
  begin_shift(searching);
  try {
    Work work;
    while (!gate_.stopped()) {
      if (find(work)) {
        perform(work);
      } else if (!search()) {
        break;
      }
    }
  } catch (
      ...) {  // from a kernel, a source, a policy or a progress callback, or for lack of memory
    core_.fail(std::current_exception());
  }
  end_shift();
}

void Worker::begin_shift(bool searching) {
  came_ = search_began_ = core_.clock.ticks();
  if (runner_.stats().arrivals != 0) {
    runner_.record({.begin = left_, .end = came_, .kind = TraceEvent::Kind::away});
  }
  runner_.set_now(came_);
  searching_ = searching;
  runner_.stats().doing.set(searching ? kSearching : kBetweenBatches);
  ++runner_.stats().arrivals;
  core_.check_end();
}

bool Worker::find(Work& work) {
  if (gate_.stopped() || !acquire(work)) {
    return false;
  }
  if (searching_) {
    found_work();
  }
  return true;
}

void Worker::end_shift() {
  runner_.credits().return_all();
  left_ = core_.clock.ticks();
  if (searching_) {
    end_search(left_);
  } else {
    gate_.begin_search();  // leave() expects it
  }
  runner_.stats().present_ticks += left_ - came_;
  runner_.stats().doing.set(kAway);
}

RunState::Worker Worker::state() const {
  RunState::Worker state = runner_.state();
  state.ready_blocks = ready_.size();
  state.ready_partial = ready_.partials();
  return state;
}

// The order of the whole scheduler is here: what is ready; then new items while credits are plenty,
// which keeps this worker on its own data (but before them, what threads outside have emitted);
// then what others have ready; then partial blocks, last of all those that have been offered to
// others, who need time to come; and new items once more, one by one if need be.
bool Worker::acquire(Work& work) {
  if (in_order_) {
    return acquire_in_order(work);
  }
  return take_ready(work, offers_stand() ? layout_.lanes : layout_.ready_lanes()) ||
         (!plain_ && take_from_outside(work)) || take_source(work, false) || steal(work) ||
         take_open(work) || take_ready(work, layout_.ready_lanes()) || take_source(work, true);
}

// Where bins are in order, the nearest block comes before what others have, full or not.
bool Worker::acquire_in_order(Work& work) {
  const bool found = take_source(work, false) || (!plain_ && take_from_outside(work)) ||
                     take_nearest(work) || steal(work) || take_source(work, true);
  if (found && !work.is_source) {
    move_on_to(work.block.bin);
  }
  return found;
}

bool Worker::take_nearest(Work& work) {
  for (;;) {
    const OpenTable::Nearest open = runner_.open().nearest(begin_, layout_.lanes);
    const std::uint32_t lane = ready_.best_lane();
    const bool is_ready = lane != Bitmap::kNone;
    const std::uint32_t distance = lane >= begin_ ? lane - begin_ : lane + layout_.lanes - begin_;
    if (is_ready && distance <= open.distance) {
      if (take_ready(work, layout_.ready_lanes())) {
        return true;
      }
      continue;  // a thief was quicker
    }
    if (open.bit == Bitmap::kNone) {
      return false;
    }
    work.block = runner_.open().take(open.bit);
    work.cause = FlushCause::idle;
    work.is_source = work.stolen = false;
    if (plain_) {
      return true;
    }
    runner_.stats().stages[work.block.stage].published.add(work.block.items);
    if (leaves_freely(work.block, work.cause)) {
      return true;
    }
  }
}

// On a ring, the order of a worker goes with it.
void Worker::move_on_to(std::uint32_t bin) {
  if (half_ == 0) {
    return;
  }
  const std::uint32_t begin = bin >= half_ ? bin - half_ : bin + layout_.lanes - half_;
  if (begin != begin_) {
    begin_ = begin;
    ready_.begin_at(begin);
    runner_.open().begin_at(begin);
  }
}

// An offer stands for a while, and longer if somebody is on the way. Not for ever: an arena may be
// too busy to send anybody.
bool Worker::offers_stand() const {
  if (ready_.partials() == 0 || runner_.now() < share_after_) {
    return true;  // in the first case there is nothing to take back anyway
  }
  return gate_.relaxed_view().invited() != 0 && runner_.now() < share_after_ + kLongestSharePause;
}

bool Worker::take_ready(Work& work, std::uint32_t end_lane) {
  ReadyBlock* ready = ready_.take(newest_first_, end_lane);
  if (ready == nullptr) {
    return false;
  }
  taken_back_ += ready->offered ? 1 : 0;
  unpack(ready, work);
  return true;
}

void Worker::unpack(ReadyBlock* ready, Work& work) {
  work.block = ready->block;
  work.cause = ready->cause;
  work.is_source = false;
  work.stolen = false;
  runner_.cache().release(layout_.node_class, reinterpret_cast<std::byte*>(ready));
}

bool Worker::take_source(Work& work, bool last_resort) {
  const std::int64_t credits = runner_.credits().pocket() + core_.credits.available();
  if ((!last_resort && credits < layout_.least_plenty) || !core_.sources_open()) {
    return false;
  }
  const auto count = static_cast<std::uint32_t>(layout_.sources.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t index = (next_source_ + i) % count;
    const SourceLayout& source = layout_.sources[index];
    const std::int64_t least = last_resort ? source.charge : source.plenty;
    if (credits < least || !core_.try_enter_source(index)) {
      continue;
    }
    const std::int64_t got = runner_.credits().reserve(least, source.burst * source.charge);
    if (got == 0) {
      core_.leave_source(index, false);
      continue;
    }
    work.is_source = true;
    work.source = index;
    work.budget = static_cast<std::uint32_t>(std::min(got / source.charge, source.burst));
    next_source_ = index + 1;
    return true;
  }
  return false;
}

bool Worker::steal(Work& work) {
  const std::uint32_t workers = layout_.workers;
  if (workers == 1) {
    return false;
  }
  std::uint32_t victim = next_victim_;
  for (std::uint32_t i = 0; i < workers; ++i, ++victim) {
    victim = victim < workers ? victim : 0;
    if (victim == index_) {
      continue;
    }
    ReadyQueue& queue = core_.worker(victim).ready_;
    ReadyBlock* list = queue.steal(kWorthStealing);
    if (list == nullptr) {
      continue;
    }
    next_victim_ = victim;
    if (runner_.trace() != nullptr) {
      runner_.record(
          {.begin = core_.clock.ticks(), .node = victim, .kind = TraceEvent::Kind::steal});
    }
    ReadyBlock* rest = list->newer;
    ++runner_.stats().stages[list->block.stage].steals;
    unpack(list, work);
    work.stolen = true;
    while (rest != nullptr) {
      ReadyBlock* next = rest->newer;
      ++runner_.stats().stages[rest->block.stage].steals;
      if (rest->offered) {  // from now on this worker's own, to be run before it steals again
        rest->offered = false;
        rest->lane -= in_order_ ? 0 : layout_.lanes;
      }
      ready_.push(rest);
      rest = next;
    }
    return true;
  }
  return false;
}

bool Worker::take_open(Work& work) {
  work.cause = FlushCause::idle;
  work.is_source = false;
  work.stolen = false;
  return plain_ ? runner_.open().take_best(work.block) : take_open_that_leaves_freely(work);
}

bool Worker::take_open_that_leaves_freely(Work& work) {
  while (runner_.open().take_best(work.block)) {
    runner_.stats().stages[work.block.stage].published.add(work.block.items);
    // What runs at once needs no place to wait.
    if (!layout_.stages[work.block.stage].gated || leaves_freely(work.block, work.cause)) {
      return true;
    }
  }
  return false;
}

// False if the block has gone to the file or to the exchange.
bool Worker::leaves_freely(Block& block, FlushCause cause) {
  return runner_.keep(block, cause) &&
         (!layout_.stages[block.stage].gated || exchange_->admit(block, cause));
}

bool Worker::take_spilled(Work& work) {
  work.is_source = false;
  work.stolen = false;
  while (core_.spill->read_back(runner_.cache(), work.block, work.cause)) {
    if (!layout_.stages[work.block.stage].gated || exchange_->admit(work.block, work.cause)) {
      return true;
    }
  }
  return false;
}

// What waits outside of the workers: landed or spilled.
bool Worker::take_from_outside(Work& work) {
  return (exchange_ != nullptr && take_landed(work)) || (core_.spill && take_spilled(work));
}

bool Worker::take_landed(Work& work) {
  if (!exchange_->take_landed(work.block, work.cause)) {
    return false;
  }
  work.is_source = false;
  work.stolen = true;
  ++runner_.stats().stages[work.block.stage].steals;
  return true;
}

void Worker::perform(const Work& work) {
  if (work.is_source) {
    runner_.call_source(work.source, work.budget, work.virtual_ticks);
  } else {
    runner_.run(work.block, work.cause, work.virtual_ticks);
    if (!plain_ && layout_.stages[work.block.stage].cap != 0) {
      pass_token_on(work.block.stage);
    }
  }
  runner_.stats().doing.set(kBetweenBatches);
  after_call();
}

void Worker::pass_token_on(std::uint32_t stage) {
  Block block;
  FlushCause cause;
  if (exchange_->pass_on(stage, block, cause)) {
    push_ready(block, cause);
  }
}

void Worker::after_call() {
  core_.check_end();
  if (has_chores_) {
    do_chores();
  }
  const Gate::View seen =
      gate_.relaxed_view();  // relaxed: a hint, and looked at again after every call
  if (seen.searching() != 0 || gate_.hungry(seen)) {
    share();
  }
}

void Worker::do_chores() {
  core_.maybe_report_progress();
  if (linger_ticks_ != 0) {
    flush_lingering();
  }
  if (layout_.blocking_threads != 0) {
    feed_blocking_stages();
  }
  if (runner_.trace() != nullptr && runner_.now() >= next_sample_) {
    sample_queues();
  }
}

// The counters of a trace.
void Worker::sample_queues() {
  const std::uint64_t now = runner_.now();
  next_sample_ = now + (core_.clock.is_virtual() ? kSampleNanoseconds : kSampleTicks);
  const std::int64_t lent = core_.credits.limit() - core_.credits.available();
  runner_.record({.begin = now,
                  .end = static_cast<std::uint64_t>(std::max<std::int64_t>(0, lent)),
                  .kind = TraceEvent::Kind::in_flight});
  runner_.record({.begin = now,
                  .bin = runner_.open().count(),
                  .items = ready_.size(),
                  .kind = TraceEvent::Kind::queues});
  for (std::uint32_t stage = 0; stage < layout_.stages.size(); ++stage) {
    if (layout_.stages[stage].gated) {
      runner_.record({.begin = now,
                      .end = exchange_->waiting(stage),
                      .node = stage,
                      .kind = TraceEvent::Kind::waiting});
    }
  }
}

// Threads that block have nothing else to do than what they are given: they need not wait until
// blocks are full.
void Worker::feed_blocking_stages() {
  Block block;
  for (std::uint32_t stage = 0; stage < layout_.stages.size(); ++stage) {
    while (layout_.stages[stage].blocking && exchange_->waiting(stage) == 0 &&
           runner_.open().take_fullest(stage, block)) {
      publish(block, FlushCause::asked);
    }
  }
}

void Worker::flush_lingering() {
  runner_.open().set_time(runner_.now());
  Block block;
  while (ready_.partials() < kPartialsPerWorker && runner_.now() > linger_ticks_ &&
         runner_.open().take_older_than(runner_.now() - linger_ticks_, block)) {
    publish(block, FlushCause::linger);
  }
}

// Somebody is without work. Let them have half of the open blocks, unless there is something
// published to take, or they did not come for what they were offered last time: moving a few tiny
// items costs more than handling them here.
void Worker::share() {
  if (ready_.size() == 0 && core_.options.flush.idle && runner_.now() >= share_after_) {
    const bool in_vain = shared_ != 0 && taken_back_ >= shared_;
    share_pause_ = in_vain ? std::min(share_pause_ * 2, kLongestSharePause) : kFirstSharePause;
    share_after_ = runner_.now() + share_pause_;
    shared_ = taken_back_ = 0;
    const std::uint32_t count = std::min(runner_.open().count() / 2, kPartialsPerWorker);
    Block block;
    for (std::uint32_t i = 0; i < count && runner_.open().take_best(block); ++i) {
      publish(block, FlushCause::asked);
      ++shared_;
    }
  } else if (ready_.size() != 0 || core_.wants_a_worker()) {
    core_.invite();
  }
}

void Worker::publish(const Block& block, FlushCause cause) {
  // Before others can retire these items: what they give back must have been taken, or a source
  // would find credits that nobody has given back yet.
  runner_.credits().charge(runner_.open().take_spent());
  if (plain_) {
    push_ready(block, cause);
    return;
  }
  runner_.stats().stages[block.stage].published.add(block.items);
  Block leaving = block;
  if (leaves_freely(leaving, cause)) {
    push_ready(leaving, cause);
  }
}

void Worker::push_ready(const Block& block, FlushCause cause) {
  ++published_;
  auto* ready = ::new (runner_.cache().allocate(layout_.node_class)) ReadyBlock;
  ready->block = block;
  ready->cause = cause;
  ready->partial = cause != FlushCause::full && cause != FlushCause::count;
  // Full blocks before partial ones. A block that has lingered counts as full: it has waited
  // enough.
  ready->offered = cause == FlushCause::asked;
  ready->lane = lane_of(block) + (ready->offered && !in_order_ ? layout_.lanes : 0);
  ready_.push(ready);
  if (gate_.hungry(gate_.view())) {
    core_.invite();
  }
}

std::uint32_t Worker::lane_of(const Block& block) const {
  const StageLayout& stage = layout_.stages[block.stage];
  switch (core_.options.policy.kind()) {
    case Policy::Kind::deepest_first:
      return stage.rank_lane;
    case Policy::Kind::fullest_first: {
      const std::uint64_t filled =
          std::uint64_t{block.items} * (layout_.lanes - 1) / stage.block_items;
      return layout_.lanes - 1 - static_cast<std::uint32_t>(filled);
    }
    case Policy::Kind::oldest_first:
      return 0;
    case Policy::Kind::bins_in_order:
      return block.bin;
    case Policy::Kind::custom:
      break;
  }
  const std::uint32_t lane = core_.options.policy.lane_function()({.stage = block.stage,
                                                                   .bin = block.bin,
                                                                   .items = block.items,
                                                                   .capacity = stage.block_items,
                                                                   .rank = stage.rank});
  return std::min(lane, layout_.lanes - 1);
}

// search looks around for a moment. True: try again. False: there is nothing, leave.
bool Worker::search() {
  if (begin_search()) {
    return true;
  }
  while (search_goes_on()) {
    if (sees_work()) {
      return true;
    }
    cpu_pause();
  }
  return false;
}

bool Worker::begin_search() {
  runner_.credits().return_all();  // before looking at the sources: see Gate
  const bool errand = exchange_ != nullptr && exchange_->take_errand();
  if (!searching_) {
    searching_ = true;
    runner_.stats().doing.set(kSearching);
    search_began_ = core_.clock.ticks();
    gate_.begin_search();
  }
  return errand || core_.source_ready();
}

bool Worker::search_goes_on() const {
  const Gate::View seen = gate_.relaxed_view();
  // Without anybody at work, nothing can turn up.
  return !gate_.stopped() && core_.clock.ticks() - search_began_ < kSearchTicks &&
         seen.active() > seen.searching();
}

bool Worker::sees_work() const {
  return gate_.any_ready() || core_.wants_a_worker();
}

void Worker::found_work() {
  searching_ = false;
  end_search(core_.clock.ticks());
  // Others kept quiet while somebody was searching. If that was the last searcher and there is
  // more, call the next.
  if (gate_.hungry(gate_.end_search()) && gate_.any_ready()) {
    core_.invite();
  }
}

void Worker::end_search(std::uint64_t ticks) {
  runner_.stats().search_ticks += ticks - search_began_;
  runner_.record({.begin = search_began_, .end = ticks, .kind = TraceEvent::Kind::search});
}

std::uint64_t Worker::drop_all() {
  std::uint64_t items = runner_.open().drop_all();
  while (const ReadyBlock* ready = ready_.take(true, layout_.ready_lanes())) {
    items += ready->block.items;
  }
  return items;
}

}  // namespace carpool
