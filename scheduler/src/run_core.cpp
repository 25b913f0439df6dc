// The shared state of a run: sources, the end, and the sums for the report.
#include "run_core.h"

#include <algorithm>
#include <thread>

#include "blocking_worker.h"
#include "exchange.h"
#include "spill.h"
#include "worker.h"

namespace carpool {
namespace {

// Needs a calibration of a millisecond, once per process and only by runs that use
// FlushOptions::linger.
std::uint64_t to_ticks(std::chrono::nanoseconds time) {
  if (time.count() <= 0) {
    return 0;
  }
  static const double seconds_per_tick = [] {
    const TickClock clock;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return clock.seconds_per_tick();
  }();
  return std::max<std::uint64_t>(
      1,
      static_cast<std::uint64_t>(std::chrono::duration<double>(time).count() / seconds_per_tick));
}

std::vector<std::vector<std::uint8_t>> allowed_edges(const Graph& graph) {
  std::vector<std::vector<std::uint8_t>> rows;
  const auto add = [&](const std::vector<std::uint32_t>& successors) {
    std::vector<std::uint8_t> row(successors.empty() ? 0 : graph.stages().size(), 0);
    for (const std::uint32_t to : successors) {
      row[to] = 1;
    }
    rows.push_back(std::move(row));
  };
  for (const auto& stage : graph.stages()) {
    add(stage.successors);
  }
  for (const auto& source : graph.sources()) {
    add(source.successors);
  }
  return rows;
}

}  // namespace

RunCore::RunCore(const Graph& g, const RunOptions& o, std::uint32_t worker_count,
                 Summoner* summoner)
    : graph(g),
      options(o),
      layout(g, o, worker_count),
      gate(std::make_shared<Gate>(worker_count)),
      credits(o.in_flight),
      pool(layout, o.overflow),
      spill(o.overflow == Overflow::spill ? std::make_unique<Spill>(layout, o.spill_folder)
                                          : nullptr),
      exchange(layout.has_exchange ? std::make_unique<Exchange>(layout, o.policy, pool, spill.get(),
                                                                *gate, summoner)
                                   : nullptr),
      clock(o.mode == RunMode::simulated
                ? RunClock(o.simulation.start.value_or(std::chrono::steady_clock::now()))
                : RunClock()),
      linger_ticks(o.mode == RunMode::simulated ? static_cast<std::uint64_t>(o.flush.linger.count())
                                                : to_ticks(o.flush.linger)),
      trace_session_(o.trace.log_.get(), g, layout, clock),
      summoner_(summoner),
      allowed_(allowed_edges(g)),
      sources_(g.sources().size()),
      open_sources_(static_cast<std::uint32_t>(g.sources().size())),
      next_progress_ns_(std::chrono::nanoseconds(o.progress_every).count()) {
  for (std::uint32_t i = 0; i < worker_count; ++i) {
    workers_.push_back(std::make_unique<Worker>(*this, i));
  }
  for (std::uint32_t s = 0; s < layout.stages.size(); ++s) {
    for (std::uint32_t i = 0; layout.stages[s].blocking && i < g.stages()[s].options.concurrency;
         ++i) {
      const auto index = worker_count + static_cast<std::uint32_t>(blocking_workers_.size());
      blocking_workers_.push_back(std::make_unique<BlockingWorker>(*this, s, index));
    }
  }
  options.monitor.show(*this);
}

RunCore::~RunCore() {
  options.monitor.forget(*this);
}

void RunCore::serve(bool searching) {
  const std::uint32_t seat = gate->take_seat();
  workers_[seat]->serve(searching);
  gate->release_seat(seat);
}

void RunCore::invite() {
  switch (gate->invite()) {
    case Gate::Invited::helper:
      summoner_->summon();
      break;
    case Gate::Invited::caller:
      summoner_->caller_called();
      break;
    case Gate::Invited::nobody:
      break;
  }
}

void RunCore::fail(std::exception_ptr exception) {
  // Relaxed: only one may write; the gate's leave() hands what was written to the caller of run().
  if (!ended_.exchange(true, std::memory_order_relaxed)) {
    failure_ = std::move(exception);
  }
  stop();
}

void RunCore::end(Outcome outcome) {
  if (!ended_.exchange(true, std::memory_order_relaxed)) {
    outcome_ = outcome;
  }
  stop();
}

void RunCore::stop() {
  gate->stop();
  if (exchange) {
    exchange->abandon();
  }
}

bool RunCore::try_enter_source(std::uint32_t index) {
  SourceState& source = sources_[index];
  const std::uint32_t concurrency = graph.sources()[index].options.concurrency;
  std::uint32_t inside = source.inside.load(std::memory_order_relaxed);
  do {
    if (concurrency != 0 && inside >= concurrency) {
      return false;
    }
    // Acquire: see what the last call wrote, also its verdict that the source is exhausted.
  } while (!source.inside.compare_exchange_weak(inside, inside + 1, std::memory_order_acquire,
                                                std::memory_order_relaxed));
  if (source.exhausted.load(std::memory_order_relaxed)) {
    leave_source(index, false);
    return false;
  }
  return true;
}

void RunCore::leave_source(std::uint32_t index, bool exhausted) {
  SourceState& source = sources_[index];
  if (exhausted && !source.exhausted.exchange(true, std::memory_order_relaxed)) {
    open_sources_.fetch_sub(1, std::memory_order_relaxed);
  }
  source.inside.fetch_sub(1, std::memory_order_release);  // release: pairs with the next entry
}

bool RunCore::wants_a_worker() const {
  return source_ready() || (spill && spill->blocks() != 0);
}

bool RunCore::source_ready() const {
  if (!sources_open()) {
    return false;
  }
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const std::uint32_t concurrency = graph.sources()[i].options.concurrency;
    if (!sources_[i].exhausted.load(std::memory_order_relaxed) &&
        (concurrency == 0 || sources_[i].inside.load(std::memory_order_relaxed) < concurrency) &&
        credits.available() >= layout.sources[i].charge) {
      return true;
    }
  }
  return false;
}

template <class Visit>
void RunCore::for_each_runner(Visit visit) const {
  for (const auto& worker : workers_) {
    visit(worker->runner());
  }
  for (const auto& worker : blocking_workers_) {
    visit(worker->runner());
  }
}

void RunCore::maybe_report_progress() {
  if (!options.progress) {
    return;
  }
  const auto now = static_cast<std::int64_t>(clock.seconds() * 1e9);
  std::int64_t due = next_progress_ns_.load(std::memory_order_relaxed);
  // Acquire and release: one call sees what the one before it wrote. The maximum keeps others out
  // during the call.
  if (now < due ||
      !next_progress_ns_.compare_exchange_strong(due, INT64_MAX, std::memory_order_acquire)) {
    return;
  }
  Progress progress{.seconds = static_cast<double>(now) * 1e-9, .batches = 0, .item_visits = 0};
  for_each_runner([&](const BatchRunner& runner) {
    for (const StageStats& stage : runner.stats().stages) {
      progress.batches += stage.batches.get();
      progress.item_visits += stage.items.get();
    }
  });
  options.progress(progress);
  next_progress_ns_.store(now + std::chrono::nanoseconds(options.progress_every).count(),
                          std::memory_order_release);
}

RunState::Stage RunCore::stage_state(std::size_t index) const {
  RunState::Stage state{.name = graph.stages()[index].options.name};
  std::uint64_t published = 0;
  for_each_runner([&](const BatchRunner& runner) {
    // What is done is read first, so that the difference is never below zero by that.
    state.items += runner.stats().stages[index].items.get();
    state.running += runner.stats().doing.get() == kInNode + index ? 1 : 0;
  });
  for_each_runner([&](const BatchRunner& runner) {
    published += runner.stats().stages[index].published.get();
  });
  state.queued = published > state.items ? published - state.items : 0;
  return state;
}

RunState RunCore::state() const {
  const Gate::View view = gate->relaxed_view();
  RunState state{.active = view.active(),
                 .searching = view.searching(),
                 .invited = view.invited(),
                 .caller_asleep = view.caller_asleep(),
                 .stopped = gate->stopped(),
                 .over = view.closed(),
                 .credits = credits.available()};
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    state.sources.push_back({.name = graph.sources()[i].options.name,
                             .inside = sources_[i].inside.load(std::memory_order_relaxed),
                             .exhausted = sources_[i].exhausted.load(std::memory_order_relaxed)});
  }
  for (const auto& worker : workers_) {
    state.workers.push_back(worker->state());
  }
  for (const auto& worker : blocking_workers_) {
    state.blocking_threads.push_back(worker->runner().state());
  }
  for (std::size_t s = 0; s < graph.stages().size(); ++s) {
    state.stages.push_back(stage_state(s));
  }
  state.spilled_blocks = spill ? spill->blocks() : 0;
  return state;
}

namespace {

void add_stage(StageReport& sum, const StageStats& part, std::uint64_t& seats, double tick) {
  sum.batches += part.batches.get();
  sum.items += part.items.get();
  sum.steals += part.steals;
  sum.kernel_seconds += static_cast<double>(part.kernel_ticks) * tick;
  for (std::size_t c = 0; c < kFlushCauses; ++c) {
    sum.flushes_by_cause[c] += part.causes[c];
  }
  seats += part.seats;
}

double ratio(std::uint64_t a, std::uint64_t b) {
  return b == 0 ? 0.0 : static_cast<double>(a) / static_cast<double>(b);
}

WorkerReport worker_report(const WorkerStats& stats, double tick) {
  WorkerReport report;
  report.arrivals = stats.arrivals;
  for (const StageStats& stage : stats.stages) {
    report.batches += stage.batches.get();
    report.items += stage.items.get();
    report.steals += stage.steals;
    report.kernel_seconds += static_cast<double>(stage.kernel_ticks) * tick;
  }
  for (const SourceStats& source : stats.sources) {
    report.source_seconds += static_cast<double>(source.ticks) * tick;
  }
  report.search_seconds = static_cast<double>(stats.search_ticks) * tick;
  // Kernels are sampled where they are tiny, so their sum may be a little above the truth.
  report.scheduler_seconds =
      std::max(0.0, static_cast<double>(stats.present_ticks) * tick - report.kernel_seconds -
                        report.source_seconds - report.search_seconds);
  return report;
}

}  // namespace

Outcome RunCore::outcome() const {
  if (outcome_ != Outcome::completed || open_sources_.load(std::memory_order_relaxed) == 0) {
    return outcome_;
  }
  return options.cancel.cancelled() ? Outcome::cancelled
                                    : Outcome::drained;  // what else stops a source
}

RunReport RunCore::report() {
  if (failure_) {
    std::rethrow_exception(failure_);
  }
  RunReport report;
  report.outcome = outcome();
  report.policy = options.policy.name();
  report.seconds = clock.seconds();
  const double tick = clock.seconds_per_tick();
  std::vector<std::uint64_t> seats(graph.stages().size(), 0);
  for (const auto& stage : graph.stages()) {
    report.stages.push_back(
        {.name = stage.options.name, .bins = std::vector<BinReport>(stage.options.bins)});
  }
  for (const auto& source : graph.sources()) {
    report.sources.push_back({.name = source.options.name});
  }
  for_each_runner([&](const BatchRunner& runner) {
    const WorkerStats& stats = runner.stats();
    for (std::size_t s = 0; s < report.stages.size(); ++s) {
      add_stage(report.stages[s], stats.stages[s], seats[s], tick);
      for (std::uint32_t b = 0; b < report.stages[s].bins.size(); ++b) {
        const BinReport& part = stats.bins[layout.stages[s].first_slot + b];
        report.stages[s].bins[b].batches += part.batches;
        report.stages[s].bins[b].items += part.items;
      }
    }
    for (std::size_t s = 0; s < report.sources.size(); ++s) {
      report.sources[s].calls += stats.sources[s].calls;
      report.sources[s].items += stats.sources[s].items;
      report.sources[s].seconds += static_cast<double>(stats.sources[s].ticks) * tick;
    }
    report.peak_in_flight = std::max(report.peak_in_flight, runner.credits().peak_lent());
  });
  for (const auto& worker : workers_) {
    report.workers.push_back(worker_report(worker->runner().stats(), tick));
  }
  for (const auto& worker : blocking_workers_) {
    report.blocking_threads.push_back(worker_report(worker->runner().stats(), tick));
    report.blocking_seconds += report.blocking_threads.back().kernel_seconds;
  }
  for (std::size_t s = 0; s < report.stages.size(); ++s) {
    report.stages[s].run_length = ratio(report.stages[s].items, report.stages[s].batches);
    report.stages[s].seats_filled = ratio(report.stages[s].items, seats[s]);
  }
  for (const WorkerReport& worker : report.workers) {
    report.kernel_seconds += worker.kernel_seconds;
    report.source_seconds += worker.source_seconds;
    report.scheduler_seconds += worker.scheduler_seconds;
  }
  report.idle_seconds =
      std::max(0.0, report.seconds * static_cast<double>(report.workers.size()) -
                        report.kernel_seconds - report.source_seconds - report.scheduler_seconds);
  report.peak_bytes = pool.allocated_bytes() + layout.table_bytes();
  report.worst_case_bytes = layout.block_bytes() + layout.table_bytes();
  report.in_flight_limit = layout.in_flight;
  report.overflow_blocks = pool.overflow_blocks();
  for (const auto& worker : workers_) {
    report.dropped_items += worker->drop_all();
  }
  for (const auto& worker : blocking_workers_) {
    report.dropped_items += worker->dropped();
  }
  if (spill) {
    report.spilled_blocks = spill->written();
    report.peak_spill_bytes = spill->peak_bytes();
    report.dropped_items += spill->items();
  }
  report.dropped_items += exchange ? exchange->items() : 0;
  add_notes(report);
  return report;
}

// Says where keys were too many for the items that could fill them, and the like.
void RunCore::add_notes(RunReport& report) const {
  for (std::size_t s = 0; s < report.stages.size(); ++s) {
    const StageReport& stage = report.stages[s];
    const StageLayout& shape = layout.stages[s];
    const std::uint64_t per_bin =
        layout.in_flight / shape.weight / (std::uint64_t{shape.bins} * layout.workers);
    if (stage.batches > 1000 && stage.run_length < 4 && per_bin < 2 * std::uint64_t{shape.lanes} &&
        shape.bins > 1) {
      report.notes.push_back("stage '" + stage.name + "': " + std::to_string(shape.bins) +
                             " bins are too many for the items in flight (batches of " +
                             std::to_string(stage.run_length) +
                             " items on average); use fewer bins or more credits");
    }
  }
  if (report.overflow_blocks != 0) {
    report.notes.push_back("the memory bound was exceeded by " +
                           std::to_string(report.overflow_blocks) +
                           " blocks: a kernel makes more live items than were declared");
  }
}

}  // namespace carpool
