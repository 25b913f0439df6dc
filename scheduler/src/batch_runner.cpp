// A kernel call, and its books.
#include "batch_runner.h"

#include <stdexcept>
#include <string>

#include "spill.h"

namespace carpool {
namespace {

// Batches shorter than this are timed one in eight: reading the clock twice costs as much as some
// items do.
constexpr std::uint32_t kTinyBatch = 32;
constexpr std::uint32_t kTinySample = 8;
constexpr std::uint64_t kSlowBatchTicks = 4'000;
constexpr std::uint64_t kInterruptedTicks = 100'000;

}  // namespace

BatchRunner::BatchRunner(RunCore& core, std::uint32_t index, BlockSink& sink)
    : core_(core),
      layout_(core.layout),
      index_(index),
      always_timed_(core.options.deadline || core.linger_ticks != 0 || core.options.progress ||
                    core.clock.is_virtual() || core.trace() != nullptr),
      trace_(core.trace() != nullptr ? &core.trace()->lane(index) : nullptr),
      cache_(core.pool, core.layout),
      credits_(core.credits, core.layout.workers),
      open_(core.layout, core.options.policy, cache_, sink),
      stats_(core.layout.stages.size(), core.graph.sources().size(), core.layout.slots) {}

void BatchRunner::run(const Block& block, FlushCause cause, std::uint64_t virtual_ticks) {
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
    ticks = now_ - began + virtual_ticks;
    stats_.stages[block.stage].slow = ticks > kSlowBatchTicks;
    if (tiny) {
      // A sample stands for those that were not timed, but not if the system took the core away.
      ticks *= ticks < kInterruptedTicks ? tiny_batches_ : 1;
      tiny_batches_ = 0;
    }
  }
  if (trace_ != nullptr) {
    record({.begin = began - virtual_ticks,
            .end = now_,
            .node = block.stage,
            .bin = block.bin,
            .items = block.items,
            .kind = TraceEvent::Kind::batch,
            .cause = cause});
  }
  count(block, cause, ticks);
  const StageLayout& stage = layout_.stages[block.stage];
  credits_.settle(open_.take_spent(), std::int64_t{stage.weight} * block.items);
  cache_.release(stage.levels[block.level].pool_class, block.data);
  if (block.claimed) {
    core_.spill->release(block);
  }
}

RunState::Worker BatchRunner::state() const {
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
  RunState::Worker state{.doing = name(), .open_blocks = open_.count()};
  for (const StageStats& stage : stats_.stages) {
    state.batches += stage.batches.get();
    state.items += stage.items.get();
  }
  return state;
}

bool BatchRunner::keep(Block& block, FlushCause cause) {
  const StageLayout& stage = layout_.stages[block.stage];
  if (!core_.spill || block.claimed || block.items < stage.block_items ||
      core_.spill->claim(block, cause)) {
    return true;
  }
  cache_.release(stage.levels[block.level].pool_class, block.data);
  return false;
}

void BatchRunner::record(TraceEvent event) {
  using Kind = TraceEvent::Kind;
  if (trace_ == nullptr) {
    return;
  }
  const TraceLog& log = *core_.trace();
  event.begin = log.time(event.begin);
  const bool lasts = event.kind == Kind::batch || event.kind == Kind::source ||
                     event.kind == Kind::search || event.kind == Kind::away;
  event.end = lasts ? log.time(event.end) : event.end;
  event.node = event.kind == Kind::steal ? event.node : log.node(event.node);
  trace_->add(event);
}

void BatchRunner::count(const Block& block, FlushCause cause, std::uint64_t ticks) {
  StageStats& stage = stats_.stages[block.stage];
  const std::uint32_t lanes = layout_.stages[block.stage].lanes;
  stage.batches.add(1);
  stage.items.add(block.items);
  stage.seats += lanes == 1 ? block.items : (block.items + lanes - 1) / lanes * lanes;
  stage.kernel_ticks += ticks;
  ++stage.causes[static_cast<std::size_t>(cause)];
  BinReport& bin = stats_.bins[layout_.stages[block.stage].first_slot + block.bin];
  ++bin.batches;
  bin.items += block.items;
}

void BatchRunner::call_source(std::uint32_t index, std::uint32_t budget,
                              std::uint64_t virtual_ticks) {
  const std::uint64_t began = core_.clock.ticks();
  SourceContext context{.worker = index_, .budget = budget};
  const auto node = static_cast<std::uint32_t>(layout_.stages.size()) + index;
  stats_.doing.set(kInNode + node);
  open_.set_time(began);
  open_.begin_source(node, core_.allowed_from(node));
  const Graph::Source& source = core_.graph.sources()[index];
  const SourceStatus status = source.function(context, open_);
  if (open_.emitted_items() > budget) {
    throw std::logic_error("carpool: source '" + source.options.name +
                           "' emitted more items than its budget allowed");
  }
  credits_.settle(open_.take_spent(), 0);
  core_.leave_source(index, status == SourceStatus::exhausted);
  now_ = core_.clock.ticks();
  SourceStats& stats = stats_.sources[index];
  ++stats.calls;
  stats.items += open_.emitted_items();
  stats.ticks += now_ - began + virtual_ticks;
  record({.begin = began - virtual_ticks,
          .end = now_,
          .node = node,
          .items = open_.emitted_items(),
          .kind = TraceEvent::Kind::source});
}

}  // namespace carpool
