// The record of a trace: bounded, a lane per worker, written without locks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iosfwd>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "block.h"
#include "carpool/graph.h"
#include "ticks.h"

namespace carpool {

struct Layout;

// TraceEvent is one thing that happened on one lane. Times are ticks.
struct TraceEvent {
  enum class Kind : std::uint8_t { batch, source, steal, search, away, in_flight, queues, waiting };

  std::uint64_t begin = 0;
  std::uint64_t end = 0;    // of what lasts; for counters, a value
  std::uint32_t node = 0;   // TraceLog::names; for a steal, the victim
  std::uint32_t bin = 0;    // for queues, blocks being filled
  std::uint32_t items = 0;  // for queues, blocks that are ready
  Kind kind = Kind::batch;
  FlushCause cause = FlushCause::full;
};

// TraceLane is what one worker has done. Written by its worker alone, in chunks; when there are as
// many of them as it may have, the oldest is used again.
class TraceLane {
 public:
  void add(const TraceEvent& event) {
    if (used_ == kChunk) {
      next_chunk();
    }
    (*chunks_.back())[used_++] = event;
  }

  // Between runs: how many bytes it may take, and how many events have been lost by that.
  void limit(std::size_t bytes);
  std::uint64_t dropped() const { return dropped_; }

  template <class Visit>
  void for_each(Visit visit) const {
    for (const auto& chunk : chunks_) {
      const std::size_t count = &chunk == &chunks_.back() ? used_ : kChunk;
      for (std::size_t i = 0; i < count; ++i) {
        visit((*chunk)[i]);
      }
    }
  }

 private:
  static constexpr std::size_t kChunk = 256;  // events
  using Chunk = std::array<TraceEvent, kChunk>;

  void next_chunk();

  std::deque<std::unique_ptr<Chunk>> chunks_;  // the last is being written
  std::size_t used_ = kChunk;                  // of the last; none is like a full one
  std::size_t most_chunks_ = 2;
  std::uint64_t dropped_ = 0;
};

// TraceLog is all lanes of a trace, and the names that its events refer to.
class TraceLog {
 public:
  explicit TraceLog(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // begin prepares for a run whose clock shows `ticks`; end closes it.
  void begin(const Graph& graph, const Layout& layout, bool is_virtual, std::uint64_t ticks);
  void end(std::uint64_t ticks, double seconds_per_tick);

  // node returns what to write to TraceEvent::node for a node of this run: stages, then sources.
  std::uint32_t node(std::uint32_t index) const { return first_name_ + index; }
  TraceLane& lane(std::uint32_t index) { return *lanes_[index]; }

  // time turns ticks of the run into those of the log, which go on from run to run.
  std::uint64_t time(std::uint64_t ticks) const { return ticks - shift_; }

  void write(std::ostream& out) const;

 private:
  void write_event(std::ostream& out, std::size_t lane, const TraceEvent& event) const;
  double microseconds(std::uint64_t ticks) const {
    return static_cast<double>(ticks) * seconds_per_tick_ * 1e6;
  }

  const std::size_t max_bytes_;
  mutable std::mutex mutex_;  // guards `running_` and, between runs, the rest
  bool running_ = false;
  bool virtual_ = false;
  std::vector<std::unique_ptr<TraceLane>> lanes_;
  std::vector<std::string> lane_names_;
  std::vector<std::string> names_;  // of the nodes of all graphs
  std::uint32_t first_name_ = 0;    // of the run under way
  std::uint64_t shift_ = 0;
  std::uint64_t last_time_ = 0;
  double seconds_per_tick_ = 0;
};

// TraceSession is one run in a log; `log` may be null.
class TraceSession {
 public:
  TraceSession(TraceLog* log, const Graph& graph, const Layout& layout, const RunClock& clock);
  ~TraceSession();
  TraceSession(const TraceSession&) = delete;
  TraceSession& operator=(const TraceSession&) = delete;

  TraceLog* log() const { return log_; }

 private:
  TraceLog* const log_;
  const RunClock& clock_;
};

}  // namespace carpool
