// What a run works out once, before it begins: sizes of blocks, order of bins, credits, memory
// limits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "carpool/run.h"

namespace carpool {

inline constexpr std::uint32_t kMaxLevels = 16;
inline constexpr std::uint32_t kGrades = 7;  // see OpenTable
inline constexpr unsigned kTallyShift =
    32;  // a source's budget in credits and in items fits 32 bits
inline constexpr std::uint32_t kPartialsPerWorker =
    16;  // published partial blocks a worker may have out

// BlockLevel is one step of an open block on its way from empty to full. Going up a level may mean
// a larger block, or only that it is noted how much fuller this one is.
struct BlockLevel {
  std::uint32_t items = 0;       // when it has so many it goes up
  std::uint32_t bytes = 0;       // size of its memory
  std::uint32_t pool_class = 0;  // where that comes from
  std::uint32_t grade = 0;       // how full it is, as a logarithm
};

struct StageLayout {
  std::uint32_t item_bytes = 0;
  std::uint64_t item_bytes_inverse = 0;  // 2^32 / item_bytes, rounded up
  std::uint32_t first_slot = 0;
  std::uint32_t bins = 0;
  std::uint32_t block_items = 0;  // after FlushOptions::count
  std::uint32_t lanes = 1;
  std::uint32_t weight = 1;  // credits an item holds
  std::uint32_t cap = 0;     // kernel calls at once, or tokens; zero: as many as there are workers
  bool blocking = false;     // runs on threads of its own
  bool gated = false;        // has a cap or blocks: its blocks go by the exchange
  std::uint32_t first_bit = 0;  // position of bin 0 in bitmaps, which are in order of rank
  std::uint32_t rank_lane = 0;  // 0 for the highest rank
  int rank = 0;
  FlushCause full_cause = FlushCause::full;
  std::uint8_t top_level = 0;
  std::array<BlockLevel, kMaxLevels> levels{};
};

struct SourceLayout {
  std::int64_t charge = 1;  // credits per item that it emits
  std::int64_t burst = 1;   // items per call, at most
  std::int64_t plenty = 1;  // call it when so many credits are there, even if there is other work
};

// PoolClass is one size of block in the pool.
struct PoolClass {
  std::uint32_t bytes = 0;
  std::uint32_t cache = 0;  // how many free ones a worker may keep
  std::uint64_t full = 0;   // how many of those are for full blocks that wait to be run
  std::uint64_t limit = 0;  // how many there may be
};

struct Layout {
  Layout(const Graph& graph, const RunOptions& options, std::uint32_t workers);

  std::size_t block_bytes() const;  // the pool's part of the bound
  std::size_t table_bytes() const;  // the fixed tables

  // Lanes of a ReadyQueue: the policy's, and as many again, behind, for blocks that left before
  // their time.
  std::uint32_t ready_lanes() const { return 2 * lanes; }

  // How many hold blocks: workers, threads of blocking stages, and the exchange.
  std::uint32_t holders() const { return workers + blocking_threads + (has_exchange ? 1 : 0); }

  std::uint32_t workers;
  std::uint32_t blocking_threads = 0;
  bool has_exchange = false;  // is any stage gated?
  std::uint32_t slots;
  std::uint64_t in_flight;
  std::uint32_t lanes = 1;       // of the policy
  bool track_age = false;        // are open blocks linked by age?
  std::uint32_t node_class = 0;  // the pool class that ReadyBlocks come from
  std::vector<StageLayout> stages;
  std::vector<PoolClass> classes;  // ascending in size
  // What one emit adds to the tally, by stage. For kernels: the credits that the item holds. For
  // sources, whose budget is counted in items: those credits << kTallyShift, and one item.
  std::vector<std::uint64_t> weight_of;
  std::vector<std::uint64_t> tally_of;
  std::vector<SourceLayout> sources;
  std::int64_t least_plenty = 0;  // the smallest SourceLayout::plenty
  std::vector<std::uint32_t> stage_of_bit;
  std::vector<std::uint32_t> stages_by_rank;  // the highest first

 private:
  void set_caps(const Graph& graph, const RunOptions& options);
  void set_weights(const Graph& graph);
  void order_by_rank(const Graph& graph);
  void build_levels(const Graph& graph, const RunOptions& options);
  void build_ladder(StageLayout& stage, std::uint64_t thrift, bool fine) const;
  void limit_classes(bool spill);
  std::uint32_t class_of(std::uint32_t bytes) const;
};

}  // namespace carpool
