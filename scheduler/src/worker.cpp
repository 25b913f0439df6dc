// The worker's loop.
#include "worker.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "spin_lock.h"
#include "ticks.h"

namespace carpool {
namespace {

// Batches shorter than this are timed one in eight: reading the clock twice costs as much as some
// items do.
constexpr std::uint32_t kTinyBatch = 32;
constexpr std::uint32_t kTinySample = 8;
constexpr std::uint64_t kSlowBatchTicks = 4'000;
constexpr std::uint64_t kInterruptedTicks = 100'000;

// How long a worker without work looks around before it leaves, and how long an owner waits after
// sharing in vain: about the cost of an invitation. In ticks; at 1 to 4 GHz some 5 to 20
// microseconds.
constexpr std::uint64_t kSearchTicks = 20'000;
constexpr std::uint64_t kFirstSharePause = 40'000;
constexpr std::uint64_t kLongestSharePause = 4'000'000;

}  // namespace

Worker::Worker(RunCore& core, std::uint32_t index)
    : core_(core),
      layout_(core.layout),
      gate_(*core.gate),
      index_(index),
      newest_first_(core.options.policy.kind() == Policy::Kind::deepest_first),
      always_timed_(core.options.deadline || core.linger_ticks != 0 || core.options.progress ||
                    core.clock.is_virtual()),
      cache_(core.pool, core.layout),
      credits_(core.credits, core.layout.workers),
      ready_(core.layout.ready_lanes(), core.gate->ready_size(index)),
      open_(core.layout, core.options.policy, cache_, *this),
      stats_(core.layout.stages.size(), core.graph.sources().size(), core.layout.slots),
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
  came_ = now_ = search_began_ = core_.clock.ticks();
  searching_ = searching;
  stats_.doing.set(searching ? kSearching : kBetweenBatches);
  ++stats_.arrivals;
  check_end();
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
  credits_.return_all();
  const std::uint64_t left = core_.clock.ticks();
  if (searching_) {
    stats_.search_ticks += left - search_began_;
  } else {
    gate_.begin_search();  // leave() expects it
  }
  stats_.present_ticks += left - came_;
  stats_.doing.set(kAway);
}

RunState::Worker Worker::state() const {
  const std::uint64_t doing = stats_.doing.get();
  const auto name = [&]() -> std::string {
    switch (doing) {
      case kAway:
        return "away";
      case kSearching:
        return "searching";
      case kBetweenBatches:
        return "between batches";
      default:
        break;
    }
    const std::uint64_t node = doing - kInNode;
    const auto& stages = core_.graph.stages();
    return node < stages.size()
               ? "in stage " + stages[node].options.name
               : "in source " + core_.graph.sources()[node - stages.size()].options.name;
  };
  return {.doing = name(),
          .ready_blocks = ready_.size(),
          .ready_partial = ready_.partials(),
          .open_blocks = open_.count(),
          .batches = stats_.batches.get(),
          .items = stats_.items.get()};
}

// The order of the whole scheduler is here: what is ready; then new items while credits are plenty,
// which keeps this worker on its own data; then what others have ready; then partial blocks, last
// of all those that have been offered to others, who need time to come; and new items once more,
// one by one if need be.
bool Worker::acquire(Work& work) {
  return take_ready(work, offers_stand() ? layout_.lanes : layout_.ready_lanes()) ||
         take_source(work, false) || steal(work) || take_open(work) ||
         take_ready(work, layout_.ready_lanes()) || take_source(work, true);
}

// An offer stands for a while, and longer if somebody is on the way. Not for ever: an arena may be
// too busy to send anybody.
bool Worker::offers_stand() const {
  if (ready_.partials() == 0 || now_ < share_after_) {
    return true;  // in the first case there is nothing to take back anyway
  }
  return gate_.relaxed_view().invited() != 0 && now_ < share_after_ + kLongestSharePause;
}

bool Worker::take_ready(Work& work, std::uint32_t end_lane) {
  ReadyBlock* ready = ready_.take(newest_first_, end_lane);
  if (ready == nullptr) {
    return false;
  }
  unpack(ready, work);
  taken_back_ += work.cause == FlushCause::asked ? 1 : 0;
  return true;
}

void Worker::unpack(ReadyBlock* ready, Work& work) {
  work.block = ready->block;
  work.cause = ready->cause;
  work.is_source = false;
  work.stolen = false;
  cache_.release(layout_.node_class, reinterpret_cast<std::byte*>(ready));
}

bool Worker::take_source(Work& work, bool last_resort) {
  const std::int64_t credits = credits_.pocket() + core_.credits.available();
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
    const std::int64_t got = credits_.reserve(least, source.burst * source.charge);
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
  for (std::uint32_t i = 0; i < workers; ++i) {
    const std::uint32_t victim = (next_victim_ + i) % workers;
    if (victim == index_) {
      continue;
    }
    ReadyQueue& queue = core_.worker(victim).ready_;
    ReadyBlock* list = queue.steal(kTinyBatch);
    if (list == nullptr) {
      continue;
    }
    next_victim_ = victim;
    ReadyBlock* rest = list->newer;
    ++stats_.stages[list->block.stage].steals;
    unpack(list, work);
    work.stolen = true;
    while (rest != nullptr) {
      ReadyBlock* next = rest->newer;
      ++stats_.stages[rest->block.stage].steals;
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
  return open_.take_best(work.block);
}

void Worker::perform(const Work& work) {
  if (work.is_source) {
    call_source(work);
  } else {
    run_batch(work);
  }
  stats_.doing.set(kBetweenBatches);
  after_call();
}

void Worker::run_batch(const Work& work) {
  const Block& block = work.block;
  const bool tiny = block.items < kTinyBatch && !always_timed_ && !stats_.stages[block.stage].slow;
  const bool timed = !tiny || ++tiny_batches_ >= kTinySample;
  const std::uint64_t began = timed ? core_.clock.ticks() : 0;
  stats_.doing.set(kInNode + block.stage);
  open_.begin_kernel(block.stage, core_.allowed_from(block.stage));
  core_.graph.stages()[block.stage].kernel(
      {.data = block.data, .items = block.items, .bin = block.bin, .worker = index_}, open_);
  std::uint64_t ticks = 0;
  if (timed) {
    now_ = core_.clock.ticks();
    ticks = now_ - began + work.virtual_ticks;
    stats_.stages[block.stage].slow = ticks > kSlowBatchTicks;
    if (tiny) {
      // A sample stands for those that were not timed, but not if the system took the core away.
      ticks *= ticks < kInterruptedTicks ? tiny_batches_ : 1;
      tiny_batches_ = 0;
    }
  }
  count_batch(work, ticks);
  const StageLayout& stage = layout_.stages[block.stage];
  credits_.settle(open_.take_spent(), std::int64_t{stage.weight} * block.items);
  cache_.release(stage.levels[block.level].pool_class, block.data);
}

void Worker::count_batch(const Work& work, std::uint64_t ticks) {
  const Block& block = work.block;
  StageStats& stage = stats_.stages[block.stage];
  const std::uint32_t lanes = layout_.stages[block.stage].lanes;
  ++stage.batches;
  stage.items += block.items;
  stage.seats += lanes == 1 ? block.items : (block.items + lanes - 1) / lanes * lanes;
  stage.kernel_ticks += ticks;
  ++stage.causes[static_cast<std::size_t>(work.cause)];
  BinReport& bin = stats_.bins[layout_.stages[block.stage].first_slot + block.bin];
  ++bin.batches;
  bin.items += block.items;
  stats_.batches.add(1);
  stats_.items.add(block.items);
}

void Worker::call_source(const Work& work) {
  const std::uint64_t began = core_.clock.ticks();
  SourceContext context{.worker = index_, .budget = work.budget};
  const auto node = static_cast<std::uint32_t>(layout_.stages.size()) + work.source;
  stats_.doing.set(kInNode + node);
  open_.set_time(began);
  open_.begin_source(node, core_.allowed_from(node));
  const SourceStatus status = core_.graph.sources()[work.source].function(context, open_);
  if (open_.emitted_items() > work.budget) {
    throw std::logic_error("carpool: source '" + core_.graph.sources()[work.source].options.name +
                           "' emitted more items than its budget allowed");
  }
  credits_.settle(open_.take_spent(), 0);
  core_.leave_source(work.source, status == SourceStatus::exhausted);
  now_ = core_.clock.ticks();
  SourceStats& source = stats_.sources[work.source];
  ++source.calls;
  source.items += open_.emitted_items();
  source.ticks += now_ - began + work.virtual_ticks;
}

void Worker::after_call() {
  check_end();
  if (core_.options.progress) {
    core_.maybe_report_progress();
  }
  if (linger_ticks_ != 0) {
    flush_lingering();
  }
  const Gate::View seen =
      gate_.relaxed_view();  // relaxed: a hint, and looked at again after every call
  if (seen.searching() != 0 || gate_.hungry(seen)) {
    share();
  }
}

void Worker::check_end() {
  if (core_.options.cancel.cancelled()) {
    core_.end(Outcome::cancelled);
  } else if (core_.options.deadline && core_.clock.now() >= *core_.options.deadline) {
    core_.end(Outcome::deadline);
  }
}

void Worker::flush_lingering() {
  open_.set_time(now_);
  Block block;
  while (ready_.partials() < kPartialsPerWorker && now_ > linger_ticks_ &&
         open_.take_older_than(now_ - linger_ticks_, block)) {
    publish(block, FlushCause::linger);
  }
}

// Somebody is without work. Let them have half of the open blocks, unless there is something
// published to take, or they did not come for what they were offered last time: moving a few tiny
// items costs more than handling them here.
void Worker::share() {
  if (ready_.size() == 0 && core_.options.flush.idle && now_ >= share_after_) {
    const bool in_vain = shared_ != 0 && taken_back_ >= shared_;
    share_pause_ = in_vain ? std::min(share_pause_ * 2, kLongestSharePause) : kFirstSharePause;
    share_after_ = now_ + share_pause_;
    shared_ = taken_back_ = 0;
    const std::uint32_t count = std::min(open_.count() / 2, kPartialsPerWorker);
    Block block;
    for (std::uint32_t i = 0; i < count && open_.take_best(block); ++i) {
      publish(block, FlushCause::asked);
      ++shared_;
    }
  } else if (ready_.size() != 0 || core_.source_ready()) {
    core_.invite();
  }
}

void Worker::publish(const Block& block, FlushCause cause) {
  // Before others can retire these items: what they give back must have been taken, or a source
  // would find credits that nobody has given back yet.
  credits_.settle(open_.take_spent(), 0);
  auto* ready = ::new (cache_.allocate(layout_.node_class)) ReadyBlock;
  ready->block = block;
  ready->cause = cause;
  ready->partial = cause != FlushCause::full && cause != FlushCause::count;
  // Full blocks before partial ones. A block that has lingered counts as full: it has waited
  // enough.
  ready->lane = lane_of(block) + (cause == FlushCause::asked ? layout_.lanes : 0);
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
  credits_.return_all();  // before looking at the sources: see Gate
  if (!searching_) {
    searching_ = true;
    stats_.doing.set(kSearching);
    search_began_ = core_.clock.ticks();
    gate_.begin_search();
  }
  return core_.source_ready();
}

bool Worker::search_goes_on() const {
  const Gate::View seen = gate_.relaxed_view();
  // Without anybody at work, nothing can turn up.
  return !gate_.stopped() && core_.clock.ticks() - search_began_ < kSearchTicks &&
         seen.active() > seen.searching();
}

bool Worker::sees_work() const {
  return gate_.any_ready() || core_.source_ready();
}

void Worker::found_work() {
  searching_ = false;
  stats_.search_ticks += core_.clock.ticks() - search_began_;
  // Others kept quiet while somebody was searching. If that was the last searcher and there is
  // more, call the next.
  if (gate_.hungry(gate_.end_search()) && gate_.any_ready()) {
    core_.invite();
  }
}

std::uint64_t Worker::drop_all() {
  std::uint64_t items = open_.drop_all();
  while (const ReadyBlock* ready = ready_.take(true, layout_.ready_lanes())) {
    items += ready->block.items;
  }
  return items;
}

}  // namespace carpool
