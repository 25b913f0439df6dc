// What one worker counts while it works. Only its owner writes; a progress callback may read.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "carpool/report.h"

namespace carpool {

// Counter is a number with one writer and many readers: a plain addition, without a lock prefix.
class Counter {
 public:
  void add(std::uint64_t amount) {
    // Relaxed: a statistic. Exact numbers are read after the run, when the gate has synchronised.
    value_.store(value_.load(std::memory_order_relaxed) + amount, std::memory_order_relaxed);
  }
  void set(std::uint64_t value) { value_.store(value, std::memory_order_relaxed); }
  std::uint64_t get() const { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

struct StageStats {
  Counter batches;
  Counter items;
  Counter published;        // items that have left open blocks; where a monitor watches
  std::uint64_t seats = 0;  // lanes offered
  std::uint64_t steals = 0;
  std::uint64_t kernel_ticks = 0;
  bool slow = false;  // the last batch took so long that timing each costs nothing
  std::array<std::uint64_t, kFlushCauses> causes{};
};

struct SourceStats {
  std::uint64_t calls = 0;
  std::uint64_t items = 0;
  std::uint64_t ticks = 0;
};

// Activity says what a worker is doing.
enum Activity : std::uint64_t { kAway, kSearching, kBetweenBatches, kInNode };

struct WorkerStats {
  WorkerStats(std::size_t stage_count, std::size_t source_count, std::size_t slots)
      : stages(stage_count), sources(source_count), bins(slots) {}

  std::vector<StageStats> stages;
  std::vector<SourceStats> sources;
  std::vector<BinReport> bins;
  Counter doing;  // an Activity, or that plus the number of a stage or, after those, a source
  std::uint64_t arrivals = 0;
  std::uint64_t present_ticks = 0;
  std::uint64_t search_ticks = 0;

  static std::size_t bytes_for(std::size_t stage_count, std::size_t source_count,
                               std::size_t slots) {
    return stage_count * sizeof(StageStats) + source_count * sizeof(SourceStats) +
           slots * sizeof(BinReport);
  }
};

}  // namespace carpool
