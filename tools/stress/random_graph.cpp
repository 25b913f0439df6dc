// Random graphs whose result is known.
#include "random_graph.h"

#include <algorithm>
#include <chrono>
#include <thread>

namespace carpool_test {

namespace {

constexpr std::size_t kMostWorkers = 512;

void compute(std::uint64_t seed, int rounds) {
  for (int i = 0; i < rounds; ++i) {
    seed = mix(seed);
  }
  asm volatile("" : "+r"(seed));  // keeps the loop
}

// Inside counts a call for as long as it lasts.
class Inside {
 public:
  explicit Inside(std::atomic<std::uint32_t>& calls) : calls_(calls), count_(++calls) {}
  ~Inside() { --calls_; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  std::uint32_t count() const { return count_; }

 private:
  std::atomic<std::uint32_t>& calls_;
  const std::uint32_t count_;
};

}  // namespace

RandomGraph::RandomGraph(const Shape& shape)
    : shape_(shape),
      inside_(std::make_unique<std::atomic<std::uint32_t>[]>(shape.stages)),
      next_(std::make_unique<std::atomic<std::uint64_t>[]>(shape.sources)),
      counts_(kMostWorkers) {
  shape_.explicit_weights = shape.explicit_weights && shape.stages > 1;
  shape_.ping_pong = shape.ping_pong && shape.stages > 1;
  for (std::uint32_t s = 0; s < shape.stages; ++s) {
    const carpool::StageOptions options = options_of(s);
    bins_.push_back(options.bins);
    most_inside_.push_back(options.concurrency);
    stages_.push_back(graph_.add_stage<Item>(options));
  }
  for (const auto stage : stages_) {
    graph_.set_kernel(stage,
                      [this, stage](const carpool::Batch<Item>& batch, carpool::Emitter& out) {
                        work(stage.index(), batch, out);
                      });
    for (const auto to : stages_) {
      graph_.add_edge(stage, to);
    }
  }
  for (std::uint32_t i = 0; i < shape.sources; ++i) {
    const auto source =
        graph_.add_source({.name = std::string("source").append(std::to_string(i)),
                           .fan_out = shape.undeclared ? 1 : shape.fan_out,
                           .concurrency = shape.source_concurrency,
                           .burst = 256},
                          [this, i](carpool::SourceContext& ctx, carpool::Emitter& out) {
                            return produce(i, ctx, out);
                          });
    for (const auto to : stages_) {
      graph_.add_edge(source, to);
    }
  }
}

carpool::StageOptions RandomGraph::options_of(std::uint32_t stage) const {
  const std::uint64_t dice = mix(shape_.seed * 1000 + stage);
  const bool narrow = shape_.explicit_weights && stage + 1 == shape_.stages;
  const bool blocking = shape_.blocking && (dice >> 40) % 2 == 0;
  const bool capped = blocking || (shape_.caps && (dice >> 44) % 2 == 0);
  return {.name = std::string("s").append(std::to_string(stage)),
          .bins = static_cast<std::uint32_t>(1 + dice % shape_.most_bins),
          .block_items = shape_.block_items,
          .lanes = 8,
          .rank = static_cast<int>(dice >> 32 & 3),
          .weight = narrow ? 1U : 0U,
          .concurrency = capped ? static_cast<std::uint32_t>(1 + (dice >> 48) % 3) : 0U,
          .blocking = blocking};
}

RandomGraph::Item RandomGraph::root(std::uint32_t source, std::uint64_t index) const {
  const std::uint64_t path = mix(shape_.seed ^ mix(index * 31 + source));
  return {.path = path,
          .hops = static_cast<std::uint32_t>(1 + (path >> 20) % shape_.most_hops),
          .width = shape_.fan_out};
}

std::uint32_t RandomGraph::stage_of(const Item& item) const {
  const auto count = shape_.stages;
  const auto stage =
      shape_.ping_pong ? item.hops % 2 : static_cast<std::uint32_t>((item.path >> 33) % count);
  // With explicit weights, only items that can no longer split may go to the last stage.
  return shape_.explicit_weights && item.width > 1 && stage + 1 == count ? 0 : stage;
}

std::uint32_t RandomGraph::bin_of(const Item& item) const {
  return shape_.one_bin_flood
             ? 0
             : static_cast<std::uint32_t>((item.path >> 7) % bins_[stage_of(item)]);
}

template <class Emit>
void RandomGraph::successors(const Item& item, Emit emit) const {
  if (item.hops <= 1) {
    return;
  }
  std::uint32_t width = item.width;
  std::uint32_t child = 0;
  while (width > 0) {
    const std::uint64_t path = mix(item.path + 77 * ++child);
    std::uint32_t share = width;
    if (width > 1 && (shape_.split_early || path % 3 == 0)) {
      share = shape_.split_early ? 1 : static_cast<std::uint32_t>(1 + path / 3 % width);
    }
    width -= share;
    if (child > 1 && !shape_.split_early && path % 5 == 0) {
      continue;  // a dead end
    }
    emit(Item{.path = path, .hops = item.hops - 1, .width = share});
  }
}

void RandomGraph::work(std::uint32_t stage, const carpool::Batch<Item>& batch,
                       carpool::Emitter& out) {
  if (over_.load()) {
    late_.fetch_add(1);
  }
  const Inside inside(inside_[stage]);
  if (most_inside_[stage] != 0 && inside.count() > most_inside_[stage]) {
    crowded_ = true;
  }
  if (on_batch) {
    on_batch();
  }
  if (const std::uint64_t dice = batch.items.front().path; shape_.sleeping && dice % 8 == 0) {
    std::this_thread::sleep_for(std::chrono::microseconds((dice >> 8) % 250));
  }
  Tally& tally =
      counts_[batch.worker].tally;  // not atomic: the scheduler promises one call per worker
  for (const Item& item : batch.items) {
    if (lose_items && item.path % 999 == 0) {
      continue;
    }
    if (bin_of(item) != batch.bin) {
      tally.sum += 1;  // spoils the comparison
    }
    ++tally.visits;
    tally.sum += visit_value(item);
    take_time(item);
    successors(
        item, [&](const Item& child) { out.emit(stages_[stage_of(child)], bin_of(child), child); });
  }
}

void RandomGraph::take_time(const Item& item) const {
  if (shape_.uneven && item.path % 64 == 0) {
    compute(item.path, 2000);
  }
  if (shape_.lumps && item.path % 1024 == 1) {
    compute(item.path, 200'000);
  }
}

carpool::SourceStatus RandomGraph::produce(std::uint32_t source, carpool::SourceContext& ctx,
                                           carpool::Emitter& out) {
  if (over_.load()) {
    late_.fetch_add(1);
  }
  if (on_source) {
    on_source();
  }
  const std::uint64_t first = next_[source].fetch_add(ctx.budget);
  const std::uint64_t last = std::min<std::uint64_t>(shape_.items, first + ctx.budget);
  for (std::uint64_t index = first; index < last; ++index) {
    const Item item = root(source, index);
    out.emit(stages_[stage_of(item)], bin_of(item), item);
  }
  return first + ctx.budget >= shape_.items ? carpool::SourceStatus::exhausted
                                            : carpool::SourceStatus::more;
}

Tally RandomGraph::counted() const {
  Tally sum;
  for (const Count& count : counts_) {
    sum.visits += count.tally.visits;
    sum.sum += count.tally.sum;
  }
  return sum;
}

void RandomGraph::add_to(Tally& tally, const Item& item) const {
  ++tally.visits;
  tally.sum += visit_value(item);
  successors(item, [&](const Item& child) { add_to(tally, child); });
}

Tally RandomGraph::tally_of_first(const std::function<std::uint64_t(std::uint32_t)>& items) const {
  Tally tally;
  for (std::uint32_t source = 0; source < shape_.sources; ++source) {
    for (std::uint64_t index = 0; index < items(source); ++index) {
      add_to(tally, root(source, index));
    }
  }
  return tally;
}

Tally RandomGraph::expected() const {
  return tally_of_first([this](std::uint32_t) { return shape_.items; });
}

Tally RandomGraph::admitted() const {
  return tally_of_first([this](std::uint32_t source) {
    return std::min<std::uint64_t>(shape_.items, next_[source].load());
  });
}

}  // namespace carpool_test
