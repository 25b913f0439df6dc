// Works out the sizes of a run, and the bound on its memory.
#include "layout.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>
#include <string>

#include "open_table.h"
#include "ready_queue.h"
#include "stats.h"

namespace carpool {
namespace {

constexpr std::uint32_t kLine = 64;
constexpr std::uint64_t kMaxBlockBytes = 64ULL << 20;
constexpr std::uint64_t kMaxCredits = 1ULL << 31;  // fits kTallyShift bits

std::uint64_t round_up_to_line(std::uint64_t bytes) {
  return (bytes + kLine - 1) / kLine * kLine;
}

// 0 for one item, 1 for two to four, 2 for five to sixteen, ...
std::uint32_t grade_of(std::uint32_t least_items) {
  const auto bits = static_cast<std::uint32_t>(std::bit_width(least_items - 1));
  return std::min((bits + 1) / 2, kGrades - 1);
}

}  // namespace

Layout::Layout(const Graph& graph, const RunOptions& options, std::uint32_t worker_count)
    : workers(worker_count), slots(graph.slots()), in_flight(options.in_flight) {
  if (in_flight == 0 || in_flight > kMaxCredits) {
    throw std::invalid_argument("carpool: RunOptions::in_flight must be between 1 and 2^31");
  }
  stages.resize(graph.stages().size());
  track_age =
      options.flush.linger.count() > 0 || options.policy.kind() == Policy::Kind::oldest_first;
  set_caps(graph, options);
  set_weights(graph);
  order_by_rank(graph);
  switch (options.policy.kind()) {
    case Policy::Kind::deepest_first:
      break;  // order_by_rank has set it
    case Policy::Kind::bins_in_order:
      for (const auto& stage : graph.stages()) {
        lanes = std::max(lanes, stage.options.bins);
      }
      break;
    case Policy::Kind::fullest_first:
    case Policy::Kind::oldest_first:
    case Policy::Kind::custom:
      lanes = options.policy.lanes();
      break;
  }
  build_levels(graph, options);
  limit_classes(options.overflow == Overflow::spill);
}

void Layout::set_caps(const Graph& graph, const RunOptions& options) {
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const StageOptions& from = graph.stages()[i].options;
    StageLayout& stage = stages[i];
    if (from.blocking && options.mode != RunMode::serial) {
      stage.blocking = true;
      blocking_threads += from.concurrency;
    } else if (!from.blocking && from.concurrency < workers) {
      stage.cap = from.concurrency;
    }
    stage.gated = stage.blocking || stage.cap != 0;
    has_exchange = has_exchange || stage.gated;
  }
}

void Layout::set_weights(const Graph& graph) {
  std::uint32_t fan_out = 1;
  for (const auto& source : graph.sources()) {
    fan_out = std::max(fan_out, source.options.fan_out);
  }
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const std::uint32_t declared = graph.stages()[i].options.weight;
    stages[i].weight = declared != 0 ? declared : fan_out;
    weight_of.push_back(stages[i].weight);
    tally_of.push_back(std::uint64_t{stages[i].weight} << kTallyShift | 1);
  }
  for (const auto& source : graph.sources()) {
    std::uint64_t charge = source.options.fan_out;
    for (std::uint32_t i = 0; i < stages.size(); ++i) {
      const auto& to = source.successors;
      if (to.empty() || std::find(to.begin(), to.end(), i) != to.end()) {
        charge = std::max<std::uint64_t>(charge, stages[i].weight);
      }
    }
    if (charge > in_flight) {
      throw std::invalid_argument(
          "carpool: source '" + source.options.name + "' needs " + std::to_string(charge) +
          " credits for one item, but RunOptions::in_flight is " + std::to_string(in_flight));
    }
    // Not for every single credit that comes back: for an eighth of all, or a burst.
    const std::uint64_t items =
        std::clamp<std::uint64_t>(in_flight / charge / 8, 1, source.options.burst);
    sources.push_back({.charge = static_cast<std::int64_t>(charge),
                       .burst = source.options.burst,
                       .plenty = static_cast<std::int64_t>(items * charge)});
  }
  least_plenty = std::min_element(sources.begin(), sources.end(), [](const auto& a, const auto& b) {
                   return a.plenty < b.plenty;
                 })->plenty;
}

void Layout::order_by_rank(const Graph& graph) {
  std::vector<std::uint32_t>& order = stages_by_rank;
  order.resize(stages.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto rank_of = [&](std::uint32_t stage) { return graph.stages()[stage].options.rank; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return rank_of(a) > rank_of(b); });
  std::uint32_t lane = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    StageLayout& stage = stages[order[i]];
    if (i > 0 && rank_of(order[i]) != rank_of(order[i - 1])) {
      ++lane;
    }
    stage.rank_lane = lane;
    stage.first_bit = static_cast<std::uint32_t>(stage_of_bit.size());
    stage_of_bit.insert(stage_of_bit.end(), graph.stages()[order[i]].options.bins, order[i]);
  }
  lanes = lane + 1;
}

void Layout::build_levels(const Graph& graph, const RunOptions& options) {
  std::uint64_t largest_item = 1;
  for (const Graph::Stage& from : graph.stages()) {
    largest_item = std::max<std::uint64_t>(largest_item, from.item_bytes);
  }
  // Small first blocks save memory where bins are many. As long as one block for every bin and
  // worker costs no more than a quarter of what the items in flight do, larger ones save copies.
  const std::uint64_t budget = std::max<std::uint64_t>(65536, in_flight * largest_item / 4);
  const std::uint64_t thrift = budget / (std::uint64_t{slots} * holders());
  std::vector<std::uint32_t> sizes{kLine};  // ReadyBlocks come from the pool, too
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const Graph::Stage& from = graph.stages()[i];
    StageLayout& stage = stages[i];
    stage.item_bytes = static_cast<std::uint32_t>(from.item_bytes);
    stage.item_bytes_inverse = ((std::uint64_t{1} << 32) + stage.item_bytes - 1) / stage.item_bytes;
    stage.first_slot = from.first_slot;
    stage.bins = from.options.bins;
    stage.lanes = from.options.lanes;
    stage.rank = from.options.rank;
    stage.block_items = from.options.block_items;
    if (options.flush.count != 0 && options.flush.count < stage.block_items) {
      stage.block_items = options.flush.count;
      stage.full_cause = FlushCause::count;
    }
    if (std::uint64_t{stage.item_bytes} * stage.block_items > kMaxBlockBytes) {
      throw std::invalid_argument("carpool: a block of stage '" + from.options.name +
                                  "' is larger than 64 MiB; lower its block_items");
    }
    build_ladder(stage, thrift, options.policy.kind() == Policy::Kind::fullest_first);
    for (std::uint32_t level = 0; level <= stage.top_level; ++level) {
      sizes.push_back(stage.levels[level].bytes);
    }
  }
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  for (const std::uint32_t bytes : sizes) {
    classes.push_back({.bytes = bytes, .cache = std::clamp(16384U / bytes, 2U, 64U), .limit = 0});
  }
  node_class = class_of(kLine);
  for (StageLayout& stage : stages) {
    for (std::uint32_t level = 0; level <= stage.top_level; ++level) {
      stage.levels[level].pool_class = class_of(stage.levels[level].bytes);
    }
  }
}

// One item, four, sixteen, ..., the full block. Two items or more are told from one because where
// keys are as many as items, choosing bins that hold two halves the number of batches. Each step is
// a branch that nobody foresees, which waits for the item's value and throws away the work on the
// next items: where bins are so few that blocks begin at their full size, most become full, and
// steps of sixteen do; and where items are many to a bin, the first step is sixteen, if blocks are
// large and have room for that from the start.
void Layout::build_ladder(StageLayout& stage, std::uint64_t thrift, bool fine) const {
  const std::uint64_t full = round_up_to_line(std::uint64_t{stage.item_bytes} * stage.block_items);
  const std::uint64_t smallest = std::min(full, thrift / kLine * kLine);
  constexpr std::uint64_t kFirstStep = 16;
  const bool many = stage.block_items >= 8 * kFirstStep && in_flight / slots >= 2 * kFirstStep &&
                    smallest >= kFirstStep * stage.item_bytes;
  std::uint64_t items = many && !fine ? kFirstStep : 1;
  std::uint32_t least = 1;
  for (std::uint32_t level = 0; level < kMaxLevels; ++level) {
    if (items * 2 > stage.block_items || level + 1 == kMaxLevels) {
      items = stage.block_items;  // a step of two at the end is not worth a size of its own
    }
    const std::uint64_t bytes = std::max(smallest, round_up_to_line(items * stage.item_bytes));
    stage.levels[level] = {.items = static_cast<std::uint32_t>(items),
                           .bytes = static_cast<std::uint32_t>(bytes),
                           .pool_class = 0,
                           .grade = grade_of(least)};
    stage.top_level = static_cast<std::uint8_t>(level);
    if (items == stage.block_items) {
      return;
    }
    least = static_cast<std::uint32_t>(items) + 1;
    items *= fine || smallest < full ? 4 : 16;
  }
}

std::uint32_t Layout::class_of(std::uint32_t bytes) const {
  const auto at = std::lower_bound(classes.begin(), classes.end(), bytes,
                                   [](const PoolClass& c, std::uint32_t b) { return c.bytes < b; });
  return static_cast<std::uint32_t>(at - classes.begin());
}

// The derivation is in README.md, section "Memory".
void Layout::limit_classes(bool spill) {
  // Each worker's own, and as many stolen ones, which it runs before it steals again.
  std::uint64_t partials = std::uint64_t{workers} * 2 * kPartialsPerWorker;
  for (const StageLayout& stage : stages) {
    partials += stage.cap;  // one for each token
  }
  const std::uint64_t holders = this->holders();
  // With a file to spill to, live items are not limited, but all full blocks beyond those that the
  // credits would allow are in the file.
  const std::uint64_t live = spill ? ~std::uint64_t{0} : in_flight;
  std::uint64_t nodes = 0;
  std::uint64_t shortest = kMaxCredits;
  for (const StageLayout& stage : stages) {
    shortest = std::min<std::uint64_t>(shortest, stage.block_items);
  }
  for (std::uint32_t c = 0; c < classes.size(); ++c) {
    std::uint64_t bins = 0;              // bins whose open block can be of this size
    std::uint64_t fewest = kMaxCredits;  // items that a block of this size holds at least
    std::uint64_t full = 0;              // full blocks of this size
    bool used = false;
    for (const StageLayout& stage : stages) {
      std::uint64_t least = 0;
      for (std::uint32_t level = stage.top_level + 1U; level-- > 0;) {
        if (stage.levels[level].pool_class == c) {
          least = level == 0 ? 1 : stage.levels[level - 1].items + 1;
        }
      }
      if (least == 0) {
        continue;  // no block of this stage is of that size
      }
      used = true;
      bins += stage.bins;
      fewest = std::min(fewest, least);
      if (stage.levels[stage.top_level].pool_class == c) {
        full =
            std::max(full, std::max<std::uint64_t>(spill ? 1 : 0, in_flight / stage.block_items));
      }
    }
    if (used) {
      const std::uint64_t open = std::min(bins * holders + partials, live / fewest);
      // Each holder may be running one block, and be copying into another.
      classes[c].full = full;
      nodes += full;
      classes[c].limit = open + full + holders * (2 + classes[c].cache);
    }
  }
  nodes = spill ? nodes : in_flight / shortest;
  classes[node_class].limit += partials + nodes + holders * (2 + classes[node_class].cache);
}

std::size_t Layout::table_bytes() const {
  return holders() * OpenTable::bytes_for(*this) + workers * ReadyQueue::bytes_for(ready_lanes()) +
         (workers + blocking_threads) *
             WorkerStats::bytes_for(stages.size(), sources.size(), slots);
}

std::size_t Layout::block_bytes() const {
  std::size_t sum = 0;
  for (const PoolClass& c : classes) {
    sum += static_cast<std::size_t>(c.limit) * c.bytes;
  }
  return sum;
}

}  // namespace carpool
