// Random graphs whose result is known: for carpool-stress and for property tests.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "carpool/carpool.h"

namespace carpool_test {

inline std::uint64_t mix(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// Shape says what a random graph looks like. All that an item does is a pure function of its path,
// so that a plain recursion can tell what the sum of a run must be.
struct Shape {
  std::uint64_t seed = 1;
  std::uint32_t stages = 4;
  std::uint32_t most_bins = 16;  // each stage has between 1 and so many
  std::uint32_t block_items = 64;
  std::uint32_t sources = 1;
  std::uint32_t items = 2000;  // per source
  std::uint32_t most_hops = 10;
  std::uint32_t fan_out = 1;  // the most live items that one source item becomes
  std::uint32_t source_concurrency = 1;
  bool one_bin_flood = false;     // everything goes to bin 0
  bool uneven = false;            // some items take a hundred times as long
  bool lumps = false;             // one item in a thousand takes ten thousand times as long
  bool sleeping = false;          // some kernel calls sleep for up to a quarter of a millisecond
  bool ping_pong = false;         // items go back and forth between the first two stages
  bool split_early = false;       // fan out as much and as soon as possible
  bool explicit_weights = false;  // the last stage never splits, and says so
  bool caps = false;              // some stages allow few calls at once
  bool blocking = false;          // some stages block, on one to three threads of their own
  bool undeclared = false;        // sources declare no fan-out, whatever it is
};

// Tally is what is compared: how many visits, and a sum over all of them that depends on every
// step.
struct Tally {
  std::uint64_t visits = 0;
  std::uint64_t sum = 0;
  bool operator==(const Tally&) const = default;
};

// RandomGraph is a graph of such a shape, with counters.
class RandomGraph {
 public:
  explicit RandomGraph(const Shape& shape);

  carpool::Graph& graph() { return graph_; }
  Tally counted() const;   // what the kernels saw; call it after the run
  Tally expected() const;  // what they must have seen in a whole run
  Tally admitted() const;  // the part of it that the sources have let in
  bool caps_held() const { return !crowded_.load(); }
  void forbid_calls() { over_.store(true); }  // from now on every kernel call is a mistake
  std::uint64_t late_calls() const { return late_.load(); }

  // A mistake, for tests of tests: some items are taken for handled.
  bool lose_items = false;

  // Called at the start of every kernel call and every source call, when set.
  std::function<void()> on_batch;
  std::function<void()> on_source;

 private:
  struct Item {
    std::uint64_t path;   // a hash of where it came from
    std::uint32_t hops;   // left to go
    std::uint32_t width;  // how many live items it may become
  };
  struct alignas(64) Count {
    Tally tally;
  };

  Item root(std::uint32_t source, std::uint64_t index) const;
  std::uint32_t stage_of(const Item& item) const;
  std::uint32_t bin_of(const Item& item) const;
  static std::uint64_t visit_value(const Item& item) { return mix(item.path * 3 + item.hops); }
  template <class Emit>
  void successors(const Item& item, Emit emit) const;
  void add_to(Tally& tally, const Item& item) const;
  Tally tally_of_first(const std::function<std::uint64_t(std::uint32_t)>& items) const;
  void take_time(const Item& item) const;
  carpool::StageOptions options_of(std::uint32_t stage) const;
  void work(std::uint32_t stage, const carpool::Batch<Item>& batch, carpool::Emitter& out);
  carpool::SourceStatus produce(std::uint32_t source, carpool::SourceContext& ctx,
                                carpool::Emitter& out);

  Shape shape_;
  carpool::Graph graph_;
  std::vector<carpool::StageHandle<Item>> stages_;
  std::vector<std::uint32_t> bins_;
  std::vector<std::uint32_t> most_inside_;  // by stage: kernel calls at once; zero: any number
  std::unique_ptr<std::atomic<std::uint32_t>[]> inside_;
  std::unique_ptr<std::atomic<std::uint64_t>[]> next_;
  std::vector<Count> counts_;
  std::atomic<bool> over_{false};
  std::atomic<bool> crowded_{false};  // more calls of a stage at once than it allows
  std::atomic<std::uint64_t> late_{0};
};

}  // namespace carpool_test
