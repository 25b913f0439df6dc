// The graph: which stages and sources there are, what they do, and who may emit to whom.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "carpool/batch.h"
#include "carpool/emitter.h"
#include "carpool/handles.h"
#include "carpool/item.h"

namespace carpool {

struct RunState;

/// StageOptions describes a stage. Every field but the name has a sensible default.
struct StageOptions {
  std::string name = {};   ///< For reports, traces and messages.
  std::uint32_t bins = 1;  ///< Items of different bins never share a batch.
  std::uint32_t block_items =
      256;                  ///< The longest batch. Its block should fit well inside the L1 cache.
  std::uint32_t lanes = 1;  ///< SIMD lanes of the kernel: only for the report's "seats filled".
  int rank = 0;             ///< Nearness to the output. Deepest-first takes the highest rank first.

  /// How many credits an item of this stage holds: the worst number of live items that it may
  /// become, itself included. Zero: as many as the largest fan_out of any source. Setting it where
  /// a stage can no longer fan out lets more items be in flight within the same bound.
  std::uint32_t weight = 0;

  /// How many calls of the kernel may be under way at once, in one run. Zero: any number; 1: one
  /// after another, so that the kernel needs no lock (each call sees what the last one wrote).
  /// Blocks that must wait for their turn keep no worker waiting; partial ones are merged. Give a
  /// serial stage a high rank: all that follows waits for it.
  std::uint32_t concurrency = 0;

  /// The kernel waits, for a disk, a network or a device. It then runs on `concurrency` threads of
  /// its own (which must not be zero), outside the arena, which are started when first needed and
  /// end with the run, and its waiting costs no worker. One call handles its items one after
  /// another, so keep block_items small. In serial runs the calling thread does all.
  bool blocking = false;
};

/// SourceStatus is what a source says about its future.
enum class SourceStatus {
  more,       ///< Call again when there are credits: at once, if this call emitted nothing.
  exhausted,  ///< Never call again in this run.
};

/// SourceContext is what a source is told when it is called.
struct SourceContext {
  std::uint32_t worker =
      0;  ///< Who calls: dense, below the run's workers, held by one call at a time.
  std::uint32_t budget =
      0;  ///< How many items may be emitted in this call; at least 1. More is an error.
};

/// SourceOptions describes a source.
struct SourceOptions {
  std::string name = {};      ///< For reports, traces and messages.
  std::uint32_t fan_out = 1;  ///< The worst number of live items that one emitted item can become.
  std::uint32_t concurrency =
      1;  ///< How many workers may be inside the source at once. Zero: any number.
  std::uint32_t burst = 1024;  ///< The largest budget of one call.
};

/// RawBatch is a batch whose item type has been forgotten.
struct RawBatch {
  const std::byte* data = nullptr;
  std::uint32_t items = 0;
  std::uint32_t bin = 0;
  std::uint32_t worker = 0;
};

using RawKernel = std::function<void(const RawBatch&, Emitter&)>;
using SourceFunction = std::function<SourceStatus(SourceContext&, Emitter&)>;

/// Graph holds stages, sources and edges. Cycles, self-edges and fan-in are all fine.
///
/// Thread safety: build it on one thread. run() only reads it, so two runs may use one graph at
/// once when its kernels allow that. Cost: nothing here is on a hot path. Errors:
/// std::invalid_argument, with a sentence that names the stage, for options that make no sense.
class Graph {
 public:
  struct Stage {
    StageOptions options;
    std::size_t item_bytes = 0;
    std::size_t item_align = 0;
    std::uint32_t first_slot = 0;           // position of bin 0 among the bins of all stages
    RawKernel kernel;                       // empty until set_kernel
    std::vector<std::uint32_t> successors;  // declared edges to stages
  };
  struct Source {
    SourceOptions options;
    SourceFunction function;
    std::vector<std::uint32_t> successors;
  };

  /// add_stage adds a stage without a kernel yet, so that kernels can name each other's stages.
  template <class T>
  StageHandle<T> add_stage(StageOptions options) {
    detail::require_item<T>();
    const std::uint32_t index = add_raw_stage(std::move(options), sizeof(T), alignof(T));
    return StageHandle<T>(index, stages_[index].first_slot, stages_[index].options.bins);
  }

  /// set_kernel says what a stage does: kernel(const Batch<T>&, Emitter&). It is called by several
  /// workers at once, for different batches; `batch.worker` tells them apart. An exception it
  /// throws ends the run.
  template <class T, class Kernel>
  requires std::invocable < const Kernel&, const Batch<T>
  &, Emitter& > void set_kernel(StageHandle<T> stage, Kernel kernel) {
    set_raw_kernel(stage.index(), [kernel = std::move(kernel)](const RawBatch& raw, Emitter& out) {
      const T* first = reinterpret_cast<const T*>(raw.data);
      kernel(Batch<T>{.items = {first, raw.items}, .bin = raw.bin, .worker = raw.worker}, out);
    });
  }

  /// add_source adds a source: function(SourceContext&, Emitter&) -> SourceStatus.
  SourceHandle add_source(SourceOptions options, SourceFunction function);

  /// add_edge declares that `from` may emit to `to`. Debug builds refuse an emit along an edge that
  /// was not declared, once the emitting node has declared any.
  template <class From, class To>
  void add_edge(StageHandle<From> from, StageHandle<To> to) {
    add_stage_edge(from.index(), to.index());
  }
  template <class To>
  void add_edge(SourceHandle from, StageHandle<To> to) {
    add_source_edge(from.index(), to.index());
  }

  /// dot returns the graph in Graphviz's language. Pipe it through `dot -Tsvg`.
  std::string dot() const { return dot(nullptr); }

  /// dot with what Monitor::look() has seen of a run of this graph: what is queued, running and
  /// done, and the fuller a stage, the stronger its colour. Any thread may call it during the run.
  std::string dot(const RunState& live) const { return dot(&live); }

  const std::vector<Stage>& stages() const { return stages_; }
  const std::vector<Source>& sources() const { return sources_; }

  /// slots returns the number of bins of all stages together.
  std::uint32_t slots() const { return slots_; }

  /// validate throws std::invalid_argument when a stage has no kernel or there is no source. run()
  /// calls it.
  void validate() const;

 private:
  std::uint32_t add_raw_stage(StageOptions options, std::size_t item_bytes, std::size_t item_align);
  void set_raw_kernel(std::uint32_t stage, RawKernel kernel);
  std::string dot(const RunState* live) const;
  void add_stage_edge(std::uint32_t from, std::uint32_t to);
  void add_source_edge(std::uint32_t from, std::uint32_t to);

  std::vector<Stage> stages_;
  std::vector<Source> sources_;
  std::uint32_t slots_ = 0;
};

}  // namespace carpool
